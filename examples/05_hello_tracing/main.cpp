// Ray queries: a mesh on a plane with its shadow, traced by a compute or by a fragment shader.

#include "common/device.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/triangle_order.h>
#include <glint/math/camera.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    Vector4f light;  // position
    Vector4f size;   // of the picture; the split between plain and coloured triangles; ray offset
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces a mesh with ray queries.");
    std::filesystem::path mesh_path;
    bool use_fragment = false;
    example.add("--mesh", mesh_path, "Mesh to show (.obj); a torus without it");
    example.add("--fragment", use_fragment, "Trace in a fragment shader instead of a compute shader");
    if (!example.parse(argc, argv)) return example.exitCode();

    // Lavapipe traces triangles that are sorted in space many times faster.
    Mesh mesh = createTorus(1.0f, 0.4f, 192, 96);
    if (!mesh_path.empty()) {
        Expected<Mesh> loaded = Mesh::load(mesh_path);
        if (!loaded) return report(loaded.error());
        mesh = std::move(*loaded);
    }
    sortTriangles(mesh);
    mesh.createNormals();

    Device device = openDevice(example, use_fragment ? FeatureFragmentTracing : FeatureComputeTracing);
    if (!device) return report(device.error());

    const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagTracing;
    const auto vertices = static_cast<uint32_t>(mesh.positions.size());
    const auto indices = static_cast<uint32_t>(mesh.indices.size());
    Buffer vertex_buffer = device.createBuffer(flags, std::span(mesh.positions), "vertices");
    Buffer normal_buffer = device.createBuffer(Buffer::FlagStorage, std::span(mesh.normals), "normals");
    Buffer index_buffer = device.createBuffer(flags, std::span(mesh.indices), "indices");

    Tracing model = device.createTracing("model");
    model.addVertexBuffer(vertices, FormatRGBf32, sizeof(Vector3f), vertex_buffer);
    model.addIndexBuffer(indices, FormatRu32, index_buffer);
    if (!model.create(Tracing::TypeTriangle, Tracing::FlagCompact | Tracing::FlagFastTrace))
        return report(model.error());

    const Mesh square = createPlane(1.0f);
    Buffer square_vertices = device.createBuffer(flags, std::span(square.positions), "plane vertices");
    Buffer square_indices = device.createBuffer(flags, std::span(square.indices), "plane indices");
    Tracing plane = device.createTracing("plane");
    plane.addVertexBuffer(static_cast<uint32_t>(square.positions.size()), FormatRGBf32, sizeof(Vector3f),
                          square_vertices);
    plane.addIndexBuffer(static_cast<uint32_t>(square.indices.size()), FormatRu32, square_indices);
    if (!plane.create(Tracing::TypeTriangle)) return report(plane.error());

    // The scene has Z up; models of files mostly have Y up. Its largest side becomes 2, and it stands on the plane.
    const BoundBox box = mesh.bounds();
    const Vector3f extent = box.max - box.min;
    const Vector3f centre = (box.min + box.max) * 0.5f;
    const float scale = 2.0f / std::max({extent.x, extent.y, extent.z});
    const bool y_up = !mesh_path.empty();
    Tracing::Instance instances[2];
    float* m = instances[0].transform;
    const auto row = [&](int i, float x, float y, float z, float w) {
        m[i * 4 + 0] = x * scale, m[i * 4 + 1] = y * scale, m[i * 4 + 2] = z * scale, m[i * 4 + 3] = w * scale;
    };
    row(0, 1, 0, 0, -centre.x);
    if (y_up) {
        row(1, 0, 0, -1, centre.z);
        row(2, 0, 1, 0, -box.min.y);
    } else {
        row(1, 0, 1, 0, -centre.y);
        row(2, 0, 0, 1, -box.min.z);
    }
    instances[0].tracing = &model;
    instances[1].transform[0] = instances[1].transform[5] = 16.0f;
    instances[1].tracing = &plane;
    instances[1].data = 1;
    Tracing scene = device.createTracing(instances);
    if (Status status = device.buildTracings({model, plane, scene}, Tracing::FlagCompact); !status)
        return report(status.error());

    Kernel kernel;
    Pipeline pipeline;
    Target target;
    Texture picture;
    if (use_fragment) {
        pipeline = device.createPipeline("trace");
        pipeline.setColorFormat(FormatRGBAu8n);
        pipeline.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", "VERTEX_SHADER=1");
        pipeline.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader", "FRAGMENT_SHADER=1");
        if (!pipeline.create()) return report(pipeline.error());
        picture = device.createTexture2D(FormatRGBAu8n, example.width(), example.height(), Texture::FlagTarget);
        target = device.createTarget(picture);
    } else {
        kernel = device.createKernel("trace");
        kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", "COMPUTE_SHADER=1");
        if (!kernel.create()) return report(kernel.error());
        picture = device.createTexture2D(FormatRGBAu8n, example.width(), example.height(), Texture::FlagSurface);
    }

    PassTimer timer(example, device);
    for (uint32_t frame = 0; frame < example.options().frames; frame++) {
        const float time = static_cast<float>(example.time(frame));
        const float angle = 0.3f * time - 1.2f;
        Camera camera;
        camera.lookAt({3.2f * std::cos(angle), 3.2f * std::sin(angle), 1.7f}, {0, 0, 0.8f});
        camera.perspective(45.0f, example.aspect());
        Parameters parameters;
        parameters.camera = camera.parameters();
        parameters.light = {2.5f, -3.0f, 5.0f, 1.0f};
        parameters.size = {static_cast<float>(example.width()), static_cast<float>(example.height()),
                           0.5f + 0.25f * std::sin(time), 1e-3f};

        const auto bind = [&](Recorder& recorder) {
            recorder.setUniform(0, parameters);
            recorder.setStorageBuffers(0, {normal_buffer, index_buffer});
            recorder.setTracing(0, scene);
        };
        Status status;
        if (use_fragment) {
            Command command = device.createCommand(target);
            timer.begin(command, "trace");
            command.setPipeline(pipeline);
            bind(command);
            command.drawArrays(3);
            timer.end(command);
            status = device.submit(command);
        } else {
            Compute compute = device.createCompute();
            timer.begin(compute, "trace");
            compute.setKernel(kernel);
            bind(compute);
            compute.setSurfaceTexture(0, picture);
            compute.dispatch(picture);
            timer.end(compute);
            status = device.submit(compute);
        }
        if (!status) return report(status.error());
        if (status = timer.collect(); !status) return report(status.error());
    }

    Statistics& statistics = example.statistics();
    statistics.counts["triangles"] = model.getPrimitives();
    statistics.counts["vertices"] = vertices;
    statistics.counts["tracing_bytes"] = model.getMemory();
    statistics.counts["build_bytes"] = model.getBuildSize();
    statistics.setRays("trace", 1ull * example.width() * example.height());
    std::printf("%llu triangles, %.1f MiB of tracing structures, %.1f ms a frame\n",
                static_cast<unsigned long long>(model.getPrimitives()),
                static_cast<double>(model.getMemory()) / (1 << 20), statistics.median("trace") * 1e-6);
    return finish(example, device, picture);
}
