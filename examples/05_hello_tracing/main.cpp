// Ray queries over 4,608 instances whose places change in every frame, from a compute or from a fragment shader.

#include "common/instance_ids.h"
#include "common/instanced_scene.h"
#include "common/viewer.h"

#include <glint/graphics/mesh_model.h>

#include <cstdio>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    Vector2f size;    // of the picture, in pixels
    float split = 0;  // between plain and coloured instances, as a share of the width
};

constexpr uint64_t record_size = 64;  // of an instance, as drivers read it

void printBytes(const char* name, uint64_t bytes) {
    std::printf("%-10s %8.1f KiB\n", name, static_cast<double>(bytes) / 1024.0);
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces 4,608 instances of a mesh with ray queries.");
    std::filesystem::path mesh_path;
    bool use_fragment = false, is_single = false;
    example.add("--mesh", mesh_path, "Mesh to show (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--single", is_single, "Show one instance, from near");
    example.addKnob("--fragment", use_fragment, "Trace in a fragment shader instead of a compute shader");
    InstanceIds ids(example);
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<InstancedScene> places = InstancedScene::load(mesh_path, is_single);
    if (!places) return report(places.error());
    Device device = openDevice(example, use_fragment ? FeatureFragmentTracing : FeatureComputeTracing);
    if (!device) return report(device.error());

    // The mesh, and the structure of its triangles.
    const MeshModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 24},
                                      {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 24}};
    const MeshModel model(device, layout, places->mesh(), MeshModel::FlagBufferStorage | MeshModel::FlagBufferTracing);
    if (!model) return report(model.error());
    const Tracing triangles = model.createTracing(Tracing::FlagCompact | Tracing::FlagFastTrace);

    // The structure of its instances, and the scratch memory that serves both.
    std::vector<Tracing::Instance> instances(places->instances());
    for (uint32_t i = 0; i < instances.size(); i++) {
        instances[i].tracing = &triangles;
        instances[i].data = i;
    }
    const Tracing scene = device.createTracing(instances, Tracing::FlagFastTrace, "scene");
    const uint64_t build_size = std::max(triangles.getBuildSize(), scene.getBuildSize());
    const Buffer scratch = device.createBuffer(Buffer::FlagScratch, build_size, "scratch");
    if (Status status = device.buildTracings({&triangles, 1}, scratch, Tracing::FlagCompact); !status)
        return report(status.error());

    Kernel kernel = device.createKernel("trace");
    Pipeline pipeline = device.createPipeline("trace");
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", "VERTEX_SHADER=1");
    pipeline.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader",
                            std::string("FRAGMENT_SHADER=1") + ids.macro());
    kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", std::string("COMPUTE_SHADER=1") + ids.macro());

    Statistics& statistics = example.statistics();
    const uint64_t tracing_bytes = triangles.getMemory() + scene.getMemory();
    statistics.counts = {{"instances", instances.size()},       {"triangles", triangles.getPrimitives()},
                         {"vertices", model.getVertices()},     {"instance_bytes", instances.size() * record_size},
                         {"tracing_bytes", tracing_bytes},      {"vertex_bytes", model.getVertexSize()},
                         {"index_bytes", model.getIndexSize()}, {"build_bytes", build_size}};

    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) {
        const auto time = static_cast<float>(frame.time);
        const std::vector<Transform3x4> transforms = places->transforms(time);
        for (size_t i = 0; i < instances.size(); i++)
            std::copy(transforms[i].rows.begin(), transforms[i].rows.end(), instances[i].transform);

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "build");
        compute.setInstances(scene, instances);
        compute.buildTracing(scene, scratch);
        frame.timer.end(compute);

        ids.begin(device, frame.width, frame.height);
        Camera camera = places->camera(time, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), places->target()), places->target());
        const auto bind = [&](Recorder& recorder) {
            recorder.setUniform(
                0, Parameters{camera.parameters(), {frame.width, frame.height}, InstancedScene::split(time)});
            recorder.setStorageBuffers(0, {model.getVertexBuffer(), model.getIndexBuffer()});
            if (ids.isWanted()) recorder.setStorageBuffer(2, ids.buffer());
            recorder.setTracing(0, scene);
        };
        if (use_fragment) {
            if (!pipeline && !pipeline.create()) return Status(pipeline.error());
            frame.target.setClearColor(Color::gray());
            Command command = device.createCommand(frame.target);
            frame.timer.begin(command, "trace");
            command.setPipeline(pipeline);
            bind(command);
            command.drawArrays(3);
            frame.timer.end(command);
            return device.submit({compute, command});
        }
        if (!kernel && !kernel.create()) return Status(kernel.error());
        frame.timer.begin(compute, "trace");
        compute.setKernel(kernel);
        bind(compute);
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());
    if (Status saved = ids.save(device); !saved) return report(saved.error());

    statistics.setRays("trace", 1ull * statistics.width * statistics.height);
    std::printf("%zu instances of %llu triangles\n", instances.size(),
                static_cast<unsigned long long>(triangles.getPrimitives()));
    for (const char* name : {"instance", "tracing", "vertex", "index", "build"})
        printBytes(name, statistics.counts[std::string(name) + "_bytes"]);
    std::printf("%.1f ms to build the scene, %.1f ms to trace it\n", statistics.median("build") * 1e-6,
                statistics.median("trace") * 1e-6);
    return viewer.finish();
}
