// 4,608 instances of a graph of levels of detail: task shaders choose the clusters and mesh shaders draw them, or a
// compute shader chooses them and indirect draws draw them.

#include "common/instance_ids.h"
#include "common/instanced_scene.h"
#include "common/viewer.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/graphics/mesh_graph_selector.h>

#include <algorithm>
#include <cstdio>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    Vector2f size;                    // of the picture, in pixels
    float split = 0;                  // between plain and coloured, as a share of the width
    float pixels = 0;                 // of error
    uint32_t cull = 0;                // MeshGraphSelector::Cull
    uint32_t has_instance_color = 0;  // else each cluster has a colour
    uint32_t reserved[2] = {};
};

// Of task shaders, as MeshGraphSelector::getCount() has it.
struct Counts {
    uint32_t clusters, wanted;
    uint32_t triangles, triangles_high;
    uint32_t outside, facing_away;
};

// Arguments of one draw, as drawElementsIndirect takes them.
constexpr uint64_t argument_size = 20;

// Corners of the triangles of all clusters, counted within the cluster.
std::vector<uint16_t> cornersOf(const MeshGraph& graph) {
    std::vector<uint16_t> corners;
    corners.reserve(graph.clusterTriangles().size() * 3);
    for (const uint32_t packed : graph.clusterTriangles())
        for (const uint32_t shift : {0u, 10u, 20u}) corners.push_back(packed >> shift & 0x3ffu);
    return corners;
}

// Why task and mesh shaders cannot draw this; empty if they can.
std::string missingOf(const Features& features) {
    const uint32_t payload = (MeshGraphModel::piece_clusters + 1) * 4;
    if (!features.meshShader) return "no mesh shaders";
    if (features.maxTaskPayload < payload || features.maxMeshVertices < 128 || features.maxMeshPrimitives < 128)
        return "too little room in mesh shaders";
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Draws 4,608 instances of a mesh at the level of detail that each of them needs.");
    std::filesystem::path mesh_path;
    bool is_single = false, use_compute = false, is_complete = false, has_instance_color = false;
    float pixels = 1.0f;
    example.add("--mesh", mesh_path, "Mesh to show (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--single", is_single, "Show one instance, from near");
    example.addKnob("--pixels", pixels, 0.0f, 32.0f, "Error in pixels that is allowed; 0 is the full mesh");
    example.addKnob("--compute", use_compute, "Choose clusters in a compute shader, draw by indirect draws");
    example.addKnob("--no-culling", is_complete, "Draw what is outside of the picture or faces away, too");
    example.addKnob("--instance-colors", has_instance_color, "A colour for each instance, not for each cluster");
    InstanceIds ids(example);
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<InstancedScene> places = InstancedScene::load(mesh_path, is_single);
    if (!places) return report(places.error());
    Device device = openDevice(example);
    if (!device) return report(device.error());
    const std::string missing = missingOf(device.getFeatures());
    if (!use_compute && !missing.empty()) {
        std::fprintf(stderr, "%s: drawing as with --compute: %s has %s\n", EXAMPLE_NAME, device.getInfo().name.c_str(),
                     missing.c_str());
        use_compute = true;
    }

    // The levels of detail.
    const Expected<MeshGraph> graph = createMeshGraph(places->mesh());
    if (!graph) return report(graph.error());
    const MeshGraphModel model(device, *graph, "mesh");
    if (!model) return report(model.error());
    const uint32_t instances = places->instances();
    const Buffer transforms = device.createBuffer(Buffer::FlagStorage, instances * sizeof(Transform3x4), "instances");
    const Buffer counts = device.createBuffer(Buffer::FlagStorage, sizeof(Counts), "counts");

    // Task and mesh shaders.
    const bool is_cpu = device.getInfo().cpu;
    const std::string macros = "MESH_PIECE=" + std::to_string(MeshGraphModel::piece_clusters) +
                               "u;MESH_GROUP=" + (is_cpu ? "8u" : "32u") + ids.macro() + ";";
    const auto configure = [&](Pipeline& pipeline) {
        pipeline.setColorFormat(FormatRGBAu8n);
        if (ids.isWanted()) pipeline.setColorFormat(FormatRu32, 1);
        pipeline.setDepthFormat(FormatDf32);
        pipeline.setDepthFunc(Pipeline::DepthFuncGreater);
        pipeline.setCullMode(Pipeline::CullModeBack);
        pipeline.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader", macros + "FRAGMENT_SHADER=1");
    };
    Pipeline mesh_pipeline = device.createPipeline("mesh");
    if (missing.empty()) {
        configure(mesh_pipeline);
        mesh_pipeline.loadShaderGLSL(Shader::TypeTask, EXAMPLE_DIR "/main.shader", macros + "TASK_SHADER=1");
        mesh_pipeline.loadShaderGLSL(Shader::TypeMesh, EXAMPLE_DIR "/main.shader", macros + "MESH_SHADER=1");
    }

    // Compute, and indirect draws.
    MeshGraphSelector selector;
    Buffer corners, arguments;
    Kernel argument_kernel = device.createKernel("arguments");
    argument_kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", macros + "ARGUMENT_SHADER=1");
    Pipeline draw_pipeline = device.createPipeline("draw");
    configure(draw_pipeline);
    draw_pipeline.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", macros + "VERTEX_SHADER=1");
    const auto createCompute = [&]() -> Status {
        if (selector) return {};
        if (!device.getFeatures().has(FeatureIndirectCount))
            return Error(ErrorCode::Unsupported, "device.unsupported",
                         device.getInfo().name + " takes no numbers of draws from buffers");
        corners = device.createBuffer(Buffer::FlagIndex, std::span<const uint16_t>(cornersOf(*graph)), "corners");
        if (Status status = argument_kernel.create(); !status) return status;
        if (Status status = draw_pipeline.create(); !status) return status;
        return selector.create(device);
    };

    Kernel id_kernel = device.createKernel("ids");
    id_kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", "ID_SHADER=1");
    Texture depth, id_picture;

    bool is_listed = false;  // the last frame, by the selector
    Statistics& statistics = example.statistics();
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) -> Status {
        if (frame.is_resized) {
            depth = device.createTexture2D(FormatDf32, frame.width, frame.height, Texture::FlagTarget, "depth");
            frame.target.setDepthTexture(depth);
            frame.target.setDepthOperation(Target::BeginClear | Target::EndDiscard);
            frame.target.setClearDepth(0.0f);
            frame.target.setClearColor(Color::gray());
            if (ids.isWanted()) {
                id_picture = device.createTexture2D(FormatRu32, frame.width, frame.height, Texture::FlagTarget, "ids");
                frame.target.setColorTexture(1, id_picture);
                frame.target.setClearColor(1, Color::black());
            }
        }
        const auto time = static_cast<float>(frame.time);
        const std::vector<Transform3x4> moved = places->transforms(time);
        device.setBuffer(transforms, std::span(moved));
        Camera camera = places->camera(time, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), places->target()), places->target());
        const MeshGraphSelector::Cull cull = is_complete ? MeshGraphSelector::CullNone : MeshGraphSelector::CullAll;
        const Parameters parameters = {.camera = camera.parameters(),
                                       .size = {frame.width, frame.height},
                                       .split = InstancedScene::split(time),
                                       .pixels = pixels,
                                       .cull = cull,
                                       .has_instance_color = has_instance_color || ids.isWanted()};
        const auto bind = [&](Command& command) {
            command.setUniform("Parameters", parameters);
            command.setStorageBuffer("Instances", transforms);
            command.setStorageBuffer("MeshClusters", model.getClusters());
            command.setStorageBuffer("Positions", model.getPositions());
            command.setStorageBuffer("Normals", model.getNormals());
            command.setStorageBuffer("ClusterVertices", model.getClusterVertices());
        };

        ids.begin(device, frame.width, frame.height);
        Compute compute = device.createCompute();
        is_listed = use_compute || !missing.empty();
        if (is_listed) {
            if (Status created = createCompute(); !created) return created;
            // The first may find that the list is too short: it grows with the second.
            Status selected;
            for (int attempt = 0; attempt < 2; attempt++) {
                Compute first = device.createCompute();
                frame.timer.begin(first, "select");
                selector.select(first, model, transforms, instances, parameters.camera, {frame.width, frame.height},
                                pixels, cull);
                frame.timer.end(first);
                if (Status submitted = device.submit(first); !submitted) return submitted;
                selected = selector.check();
                if (selected.error().id() != "selector.capacity") break;
            }
            if (!selected) return selected;

            const uint32_t capacity = selector.getCapacity();
            if (arguments.getSize() < capacity * argument_size)
                arguments = device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, capacity * argument_size,
                                                "arguments");
            frame.timer.begin(compute, "arguments");
            compute.setKernel(argument_kernel);
            compute.setStorageBuffers(0, {model.getClusters(), selector.getList(), selector.getCount(), arguments});
            compute.dispatch(4096);
            frame.timer.end(compute);

            Command command = device.createCommand(frame.target);
            frame.timer.begin(command, "draw");
            command.setPipeline(draw_pipeline);
            bind(command);
            command.setStorageBuffer("List", selector.getList());
            command.setIndexBuffer(FormatRu16, corners);
            command.drawElementsIndirect(arguments, 0, selector.getCount(), 0, capacity);
            frame.timer.end(command);
            if (Status submitted = device.submit({compute, command}); !submitted) return submitted;
        } else {
            if (!mesh_pipeline)
                if (Status created = mesh_pipeline.create(); !created) return created;
            compute.clearBuffer(counts);
            Command command = device.createCommand(frame.target);
            frame.timer.begin(command, "draw");
            command.setPipeline(mesh_pipeline);
            bind(command);
            command.setStorageBuffer("MeshGroups", model.getGroups());
            command.setStorageBuffer("MeshWalk", model.getWalk());
            command.setStorageBuffer("MeshPieces", model.getPieces());
            command.setStorageBuffer("ClusterTriangles", model.getClusterTriangles());
            command.setStorageBuffer("Counts", counts);
            command.drawMesh(instances, model.pieceCount());
            frame.timer.end(command);
            if (Status submitted = device.submit({compute, command}); !submitted) return submitted;
        }
        if (!ids.isWanted()) return {};
        if (!id_kernel)
            if (Status created = id_kernel.create(); !created) return created;
        Compute copy = device.createCompute();
        copy.setKernel(id_kernel);
        copy.setTexture(0, id_picture);
        copy.setStorageBuffer(0, ids.buffer());
        copy.dispatch(id_picture);
        return device.submit(copy);
    });
    if (!status) return report(status.error());
    if (Status saved = ids.save(device); !saved) return report(saved.error());

    Counts drawn = {};
    if (is_listed) {
        const MeshGraphSelector::Statistics selected = selector.getStatistics();
        drawn.clusters = selected.clusters;
        drawn.triangles = static_cast<uint32_t>(selected.triangles);
        drawn.triangles_high = static_cast<uint32_t>(selected.triangles >> 32);
        drawn.outside = selected.outside;
        drawn.facing_away = selected.facing_away;
    } else {
        const Expected<std::vector<Counts>> read = device.read<Counts>(counts);
        if (!read) return report(read.error());
        drawn = read->front();
    }
    const uint64_t triangles = drawn.triangles | uint64_t{drawn.triangles_high} << 32;
    statistics.counts = {{"instances", instances},
                         {"triangles", model.triangleCount() * instances},
                         {"clusters_drawn", drawn.clusters},
                         {"triangles_drawn", triangles},
                         {"outside", drawn.outside},
                         {"facing_away", drawn.facing_away},
                         {"graph_clusters", model.clusterCount()},
                         {"graph_groups", model.groupCount()},
                         {"graph_bytes", model.bytes()},
                         {"list_bytes", is_listed ? selector.getStatistics().bytes + arguments.getSize() : 0}};
    std::printf("%u instances of %llu triangles, in %u clusters of %.1f MB\n", instances,
                static_cast<unsigned long long>(model.triangleCount()), model.clusterCount(),
                static_cast<double>(model.bytes()) * 1e-6);
    std::printf("%u clusters of %llu triangles drawn; %u outside, %u facing away\n", drawn.clusters,
                static_cast<unsigned long long>(triangles), drawn.outside, drawn.facing_away);
    for (const std::string& pass : statistics.passNames())
        std::printf("%10s %8.2f ms\n", pass.c_str(), statistics.median(pass) * 1e-6);
    return viewer.finish();
}
