// Gaussian splats, of files or of meshes lit before: projected, sorted and blended by compute shaders.

#include "07_hello_splatting/scene.h"
#include "common/viewer.h"

#include <glint/graphics/splat_renderer.h>

#include <cstdio>
#include <string>

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Draws Gaussian splats with compute shaders.");
    std::vector<std::filesystem::path> files;
    std::filesystem::path mesh;
    uint32_t count = 150'000;
    bool use_float = false, use_plain = false, is_verbose = false;
    SplatRenderer::Options options;
    Vector3f shift(0.0f);
    float tilt = 0.0f, turn = 0.0f, fov = 35.0f;
    example.add("--splats", files, "Splats to show (.ply, .splat, .spz); several times: side by side");
    example.add("--mesh", mesh,
                "Without --splats: mesh to make splats of (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--count", count, "How many splats to make, with those of the floor and of the balls");
    example.add("--float", use_float, "Keep rotations and harmonics in float32 instead of 16 bits");
    example.add("--plain", use_plain, "One pixel a thread and square bounds, for comparison");
    example.add("--antialiased", options.antialiased, "Mip-Splatting's filter, for splats that were made with it");
    example.add("--degree", options.max_degree, "Highest degree of harmonics to use");
    example.add("--statistics", is_verbose, "Print the time of each pass and the memory");
    example.addKnob("--x", shift.x, -10.0f, 10.0f, "Shift of the scene");
    example.addKnob("--y", shift.y, -10.0f, 10.0f, "Shift of the scene");
    example.addKnob("--z", shift.z, -10.0f, 10.0f, "Shift of the scene, up");
    example.addKnob("--rx", tilt, -360.0f, 360.0f, "Turn of the scene about X, degrees; 230 for many captured ones");
    example.addKnob("--rz", turn, -360.0f, 360.0f, "Turn of the scene about Z, degrees");
    example.addKnob("--fov", fov, 1.0f, 170.0f, "Field of view from bottom to top, degrees");
    if (!example.parse(argc, argv)) return example.exitCode();

    Device device = openDevice(example, files.empty() ? FeatureComputeTracing : FeatureNone);
    if (!device) return report(device.error());
    const Expected<SplatScene> scene = files.empty() ? SplatScene::bake(device, mesh, count) : SplatScene::load(files);
    if (!scene) return report(scene.error());

    // The splats on the device.
    std::vector<SplatRenderer::Instance> instances;
    uint64_t model_bytes = 0;
    for (const Splats& splats : scene->models) {
        const SplatModel model(device, splats, use_float ? SplatModel::StorageFloat : SplatModel::StorageHalf);
        if (!model) return report(model.error());
        model_bytes += model.getMemory();
        instances.push_back({model});
    }

    // What draws them, and what puts a background behind them.
    SplatRenderer renderer;
    options.near = 0.05f;
    options.method = use_plain ? SplatRenderer::MethodPlain : SplatRenderer::MethodTiles;
    options.timed = device.getFeatures().has(FeatureTimestamps);
    if (Status status = renderer.create(device, options); !status) return report(status.error());
    Kernel background = device.createKernel("background");
    background.loadShaderGLSL(EXAMPLE_DIR "/main.shader");
    if (!background.create()) return report(background.error());

    Texture color;
    Statistics& statistics = example.statistics();
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) -> Status {
        if (frame.is_resized)
            color = device.createTexture2D(FormatRGBAf16, frame.width, frame.height, Texture::FlagSurface, "splats");
        const Matrix4x4f place = translate(shift) * rotateZ(turn) * rotateX(tilt);
        for (size_t i = 0; i < instances.size(); i++) instances[i].transform = place * scene->transforms[i];
        Camera camera = SplatScene::camera(static_cast<float>(frame.time), fov, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), Vector3f(0.0f)), Vector3f(0.0f));

        // The first may find that the tiles' lists are too short: they grow with the second.
        Status drawn;
        for (int attempt = 0; attempt < 2; attempt++) {
            Compute compute = device.createCompute();
            renderer.draw(compute, camera, instances, {color});
            if (Status submitted = device.submit(compute); !submitted) return submitted;
            drawn = renderer.check();
            if (drawn.error().id() != "splats.capacity") break;
        }
        if (!drawn) return drawn;
        if (options.timed) {
            const auto times = renderer.getTimes();
            if (!times) return times.error();
            for (uint32_t pass = 0; pass < SplatRenderer::PassCount; pass++)
                statistics.addPass(SplatRenderer::toString(SplatRenderer::Pass(pass)), (*times)[pass]);
        }

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "background");
        compute.setKernel(background);
        compute.setUniform(0, camera.parameters());
        compute.setTexture(0, color);
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    const SplatRenderer::Statistics drawn = renderer.getStatistics();
    statistics.counts = {{"models", instances.size()},
                         {"splats", drawn.splats},
                         {"visible", drawn.visible},
                         {"tile_entries", drawn.entries},
                         {"tile_entries_capacity", drawn.capacity},
                         {"model_bytes", model_bytes},
                         {"working_bytes", drawn.memory}};
    const auto each = static_cast<double>(std::max<uint64_t>(drawn.splats, 1));
    statistics.series["stored_bytes_per_splat"] = {static_cast<double>(model_bytes) / each};
    statistics.series["working_bytes_per_splat"] = {drawn.bytes_per_splat};
    std::printf("%llu splats, %llu of them visible, %.1f tiles each\n", static_cast<unsigned long long>(drawn.splats),
                static_cast<unsigned long long>(drawn.visible),
                static_cast<double>(drawn.entries) / static_cast<double>(std::max<uint64_t>(drawn.visible, 1)));
    if (is_verbose) {
        for (const std::string& pass : statistics.passNames())
            std::printf("%12s %8.2f ms\n", pass.c_str(), statistics.median(pass) * 1e-6);
        std::printf("%12s %8.1f bytes a splat\n%12s %8.1f bytes a splat, and %.1f MB for the tiles\n", "stored",
                    static_cast<double>(model_bytes) / each, "working", drawn.bytes_per_splat,
                    (static_cast<double>(drawn.memory) - drawn.bytes_per_splat * each) * 1e-6);
    }
    return viewer.finish();
}
