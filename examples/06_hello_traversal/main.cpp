// A ray-tracing pipeline: primary, reflection and shadow rays over 163 instances of three meshes.

#include "06_hello_traversal/scene.h"
#include "common/viewer.h"

#include <glint/device/traversal.h>
#include <glint/graphics/mesh_model.h>

#include <cstdio>
#include <cstring>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    Vector4f light = Vector4f(0.0f);
    Vector4u first_vertex = Vector4u(0u);  // of each mesh in the merged buffers
    Vector4u first_index = Vector4u(0u);
};

/// Appends what a model hands over.
MeshModel::BufferCallback appendTo(std::vector<uint8_t>& bytes) {
    return [&bytes](const void* src, size_t size) {
        bytes.resize(bytes.size() + size);
        std::memcpy(bytes.data() + bytes.size() - size, src, size);
        return true;
    };
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces reflections and shadows of 163 instances through a ray-tracing pipeline.");
    std::filesystem::path mesh_path;
    bool use_query = false, is_primary = false;
    example.add("--mesh", mesh_path, "Model to show (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--query", use_query, "Trace by ray queries in a compute shader instead of a ray-tracing pipeline");
    example.add("--primary", is_primary, "No shadows and no reflections, as on devices whose traces do not nest");
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<TraversalScene> places = TraversalScene::load(mesh_path);
    if (!places) return report(places.error());
    Device device = openDevice(example, use_query ? FeatureComputeTracing : FeatureNone);
    if (!device) return report(device.error());
    use_query = use_query || needsQueries(example, device, 1);

    // Where shaders cannot trace from shaders, there are no shadows and no reflections.
    const uint32_t most = use_query ? 2u : std::min(device.getFeatures().recursionDepth, 2u);
    const uint32_t recursion = is_primary ? 1u : most;
    Shader::setMacro("RECURSION_DEPTH", static_cast<int>(recursion));
    const char* shader = EXAMPLE_DIR "/main.shader";
    Kernel kernel;
    Traversal traversal;
    if (use_query) {
        kernel = device.createKernel("trace");
        kernel.loadShaderGLSL(shader, "QUERY_SHADER=1");
        if (!kernel.create()) return report(kernel.error());
    } else {
        traversal = device.createTraversal("trace");
        traversal.loadShaderGLSL(Shader::TypeRayGen, shader, "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, shader, "PRIMARY_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, shader, "REFLECTION_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, shader, "SHADOW_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "PRIMARY_SHADER=1; MESH=mesh_model");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "PRIMARY_SHADER=1; MESH=mesh_dodecahedron");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "PRIMARY_SHADER=1; MESH=mesh_plane");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "REFLECTION_SHADER=1; MESH=mesh_model");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "REFLECTION_SHADER=1; MESH=mesh_dodecahedron");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "REFLECTION_SHADER=1; MESH=mesh_plane");
        traversal.setRecursionDepth(recursion);
        if (!traversal.create()) return report(traversal.error());
    }

    // The meshes, one after the other in one buffer of vertices and one of indices.
    const MeshModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 24},
                                      {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 24}};
    const auto flags = MeshModel::FlagIndices32 | MeshModel::FlagBufferStorage | MeshModel::FlagBufferTracing;
    std::vector<uint8_t> vertices, indices;
    std::array<MeshModel, TraversalScene::mesh_count> models;
    std::array<std::pair<uint64_t, uint64_t>, TraversalScene::mesh_count> offsets;
    for (uint32_t i = 0; i < models.size(); i++) {
        offsets[i] = {vertices.size(), indices.size()};
        models[i].setVertexBufferCallback(appendTo(vertices));
        models[i].setIndexBufferCallback(appendTo(indices));
        if (Status status = models[i].create(device, layout, places->mesh(i), flags); !status)
            return report(status.error());
    }
    const Buffer::Flags buffer_flags = Buffer::FlagStorage | Buffer::FlagTracing;
    const Buffer vertex_buffer = device.createBuffer(buffer_flags, std::span(vertices), "vertices");
    const Buffer index_buffer = device.createBuffer(buffer_flags, std::span(indices), "indices");

    // A structure of each, and one of their instances.
    Parameters parameters;
    std::vector<Tracing> tracings;
    for (uint32_t i = 0; i < models.size(); i++) {
        models[i].setVertexBuffer(vertex_buffer, offsets[i].first);
        models[i].setIndexBuffer(index_buffer, offsets[i].second);
        tracings.push_back(models[i].createTracing(Tracing::FlagCompact | Tracing::FlagFastTrace));
        parameters.first_vertex[static_cast<int>(i)] = models[i].getBaseVertex();
        parameters.first_index[static_cast<int>(i)] = models[i].getFirstIndex();
    }
    std::vector<Tracing::Instance> instances;
    for (const TraversalScene::Instance& place : places->instances()) {
        Tracing::Instance& instance = instances.emplace_back();
        std::copy(place.transform.rows.begin(), place.transform.rows.end(), instance.transform);
        instance.tracing = &tracings[place.mesh];
        instance.offset = place.mesh;  // into the hit groups
    }
    tracings.push_back(device.createTracing(instances, Tracing::FlagFastTrace, "scene"));
    const Tracing& scene = tracings.back();
    if (Status status = device.buildTracings(tracings, Buffer(), Tracing::FlagCompact); !status)
        return report(status.error());

    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) {
        const auto time = static_cast<float>(frame.time);
        Camera camera = TraversalScene::camera(time, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), TraversalScene::target()), TraversalScene::target());
        parameters.camera = camera.parameters();
        parameters.light = Vector4f(TraversalScene::light(time), 1.0f);

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "trace");
        if (use_query)
            compute.setKernel(kernel);
        else
            compute.setTraversal(traversal);
        compute.setUniform(0, parameters);
        compute.setStorageBuffers(0, {vertex_buffer, index_buffer});
        compute.setTracing(0, scene);
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    Statistics& statistics = example.statistics();
    uint64_t geometries = 0, triangle_count = 0, vertex_count = 0, tracing_bytes = scene.getMemory();
    for (uint32_t i = 0; i < models.size(); i++) {
        geometries += models[i].getGeometries();
        triangle_count += tracings[i].getPrimitives();
        vertex_count += models[i].getVertices();
        tracing_bytes += tracings[i].getMemory();
    }
    statistics.counts = {{"geometries", geometries},
                         {"instances", instances.size()},
                         {"triangles", triangle_count},
                         {"vertices", vertex_count},
                         {"tracing_bytes", tracing_bytes}};
    // Of the camera; a hit is followed by a reflection and a shadow's ray.
    statistics.setRays("trace", 1ull * statistics.width * statistics.height);
    std::printf("%llu geometries, %llu triangles, %llu vertices; %zu instances\n",
                static_cast<unsigned long long>(geometries), static_cast<unsigned long long>(triangle_count),
                static_cast<unsigned long long>(vertex_count), instances.size());
    std::printf("%.1f ms to trace them %s\n", statistics.median("trace") * 1e-6,
                use_query ? "by ray queries" : "through a pipeline");
    return viewer.finish();
}
