// tracing.{bunny,100k,1m,instances}.{camera,bounce}.software_over_driver: rays a second of Glint's own engine over
// those of the driver's ray queries, on 16,384 rays of a million. Information, as it tells of the driver: its
// structures follow the order of the triangles, so each scene is measured in the order that it comes in and shuffled;
// ours are sorted by the builder.

#include "bench/tracing_batch.h"
#include "bench/tracing_scenes.h"
#include "common/instanced_scene.h"
#include "support/hierarchies.h"
#include "support/reference.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace glint::bench {

namespace {

constexpr uint32_t group = 64;           ///< rays that are traced together are near, as in the whole set
constexpr uint32_t sampled = 16384;      ///< rays
constexpr double longest_seconds = 4.0;  ///< of the driver for a set; what it has traced by then counts
constexpr uint32_t turns = 5;

struct Order {
    const char* figure;
    std::string name;
    Mesh mesh;
};

/// The triangles as they come, and in random order. A scene's name for the former: what made it.
std::vector<Order> ordersOf(const TracingScene& scene) {
    const char* generator = scene.name == "bunny"       ? "file order"
                            : scene.name == "instances" ? "refinement order, sorted along a curve"
                                                        : "grid order";
    std::vector<Order> orders = {{"", generator, scene.mesh}};
    Mesh shuffled = scene.mesh;
    test::Random random(7);
    for (size_t i = shuffled.triangleCount() - 1; i > 0; i--) {
        const auto other = static_cast<size_t>(random.below(i + 1));
        std::swap_ranges(&shuffled.indices[3 * i], &shuffled.indices[3 * i] + 3, &shuffled.indices[3 * other]);
    }
    if (scene.name == "instances") orders.push_back({".refinement", "refinement order", *check(refinedTorus())});
    orders.push_back({".shuffled", "shuffled", std::move(shuffled)});
    return orders;
}

/// Groups at even distances, in random order: any first part is a sample.
std::vector<Ray> sampleOf(const std::vector<Ray>& rays) {
    const size_t groups = sampled / group;
    std::vector<size_t> order(groups);
    for (size_t i = 0; i < groups; i++) order[i] = i;
    test::Random random(8);
    for (size_t i = groups - 1; i > 0; i--) std::swap(order[i], order[static_cast<size_t>(random.below(i + 1))]);
    std::vector<Ray> sample;
    for (const size_t i : order) {
        const size_t begin = i * (rays.size() / group / groups) * group;
        sample.insert(sample.end(), rays.begin() + begin, rays.begin() + begin + group);
    }
    return sample;
}

/// The driver's structures of a scene. Buffers and structures of the mesh live as long as those of instances.
struct DriverScene {
    Buffer vertices;
    Buffer indices;
    Tracing model;
    std::vector<Tracing::Instance> instances;
    Tracing scene;

    DriverScene(Device device, const Mesh& mesh, std::vector<Transform3x4> transforms)
        : vertices(device.createBuffer(Buffer::FlagTracing, std::span(mesh.positions))),
          indices(device.createBuffer(Buffer::FlagTracing, std::span(mesh.indices))),
          model(device.createTracing()) {
        model.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, sizeof(Vector3f), vertices);
        model.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32, indices);
        check(model.create(Tracing::TypeTriangle, Tracing::FlagFastTrace));
        if (transforms.empty()) transforms.resize(1);
        instances.resize(transforms.size());
        for (size_t i = 0; i < instances.size(); i++) {
            instances[i].tracing = &model;
            std::memcpy(instances[i].transform, transforms[i].rows.data(), sizeof(instances[i].transform));
        }
        scene = device.createTracing(instances);
        check(device.buildTracings({model, scene}));
        check(device.finish());
    }
};

/// Rays a second, in millions, of the best turn. (Of both sides by processor time: each keeps all of lavapipe's threads
/// busy, and whatever else the machine does is left out.)
double software(const Device& device, const TracingScene& scene, const Mesh& mesh, std::span<const Ray> rays) {
    const auto hierarchy = test::hierarchyOf(mesh, detail::BuildMode::Quality, &ThreadPool::shared());
    std::vector<detail::Texel> texels(hierarchy.texels.begin(), hierarchy.texels.end());
    if (!scene.instances.empty()) texels = test::instancesOf(hierarchy, scene.instances, &ThreadPool::shared());
    Device owner = device;
    const Buffer buffer = owner.createBuffer(Buffer::FlagTexel, std::span(texels));
    const Kernel kernel =
        createRayKernel(device, batch_kernel, scene.instances.empty() ? "" : "GLINT_TRACING_LEVELS=2");
    RayBatch batch(device, kernel, buffer, rays);
    RaceTimes times;
    for (uint32_t turn = 0; turn <= turns; turn++) times.take([&] { batch.trace(batch.size()); }, turn > 0);
    return static_cast<double>(rays.size()) * 1e-6 / times.process.minimum();
}

/// The same of the driver, once and in pieces of a group for each thread, until the time is up.
double driver(const Device& device, const DriverScene& scene, std::span<const Ray> rays, uint32_t& traced) {
    const Kernel kernel = createRayKernel(device, query_kernel, "DRIVER=1");
    RayBatch(device, kernel, scene.scene, rays.first(1)).trace(1);  // compiles
    double seconds = 0.0;
    uint32_t piece = 2 * group;
    for (traced = 0; traced < rays.size() && seconds < longest_seconds; traced += piece) {
        if (seconds < 0.1 * longest_seconds) piece = std::min<uint32_t>(2 * piece, 2048);
        piece = std::min<uint32_t>(piece, static_cast<uint32_t>(rays.size()) - traced);
        RayBatch batch(device, kernel, scene.scene, rays.subspan(traced, piece));
        RaceTimes time;
        time.take([&] { batch.trace(piece); }, true);
        seconds += time.process.minimum();
    }
    return traced * 1e-6 / seconds;
}

void run(Report& report) {
    const Device device = createDevice(TracingEngine::Driver);
    if (!device.getFeatures().computeTracing) {
        fmt::print("  left out: {} has no ray queries\n\n", device.getInfo().name);
        return;
    }
    for (const char* name : {"bunny", "100k", "1m", "instances"}) {
        if (!report.wants(fmt::format("tracing.{}.", name))) continue;
        const TracingScene scene = makeTracingScene(name);
        for (const Order& order : ordersOf(scene)) {
            const DriverScene driver_scene(device, order.mesh, scene.instances);
            for (const char* kind : {"camera", "bounce"}) {
                const std::vector<Ray> rays =
                    sampleOf(std::string_view(kind) == "camera" ? scene.camera : scene.bounce);
                uint32_t traced = 0;
                const double theirs = driver(device, driver_scene, rays, traced);
                const double ours = software(device, scene, order.mesh, rays);
                fmt::print("  {} {}, {}: ours {:.3f}, the driver {:.5f} million rays a second ({} rays)\n", name, kind,
                           order.name, ours, theirs, traced);
                report.add(fmt::format("tracing.{}.{}.software_over_driver{}", name, kind, order.figure), ours / theirs,
                           "ratio", fmt::format("the driver's ray query, {}", order.name), deviceName(device));
            }
        }
    }
}

}  // namespace

Benchmark tracingDriverBenchmark() {
    Benchmark benchmark = {{}, run};
    for (const char* scene : {"bunny", "100k", "1m", "instances"}) {
        for (const char* kind : {"camera", "bounce"}) {
            for (const char* order : {"", ".shuffled"})
                benchmark.figures.push_back(fmt::format("tracing.{}.{}.software_over_driver{}", scene, kind, order));
        }
    }
    return benchmark;
}

}  // namespace glint::bench
