// traversal.hello.*: a frame of 06_hello_traversal at 1600 x 900, as the example itself measures it: through the
// driver's ray-tracing pipeline, through its stages joined for the software engine, and by ray queries of that; and the
// same rays through Embree, one at a time on all processors. Each the best of some turns; on processors by processor
// time over the number of them. Embree shades nothing.

#include "06_hello_traversal/scene.h"
#include "accuracy/embree.h"
#include "bench/example_runs.h"
#include "bench/tracing_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <thread>

namespace glint::bench {

namespace {

constexpr uint32_t width = 1600, height = 900, tile = 4;
constexpr uint32_t turns = 3, gpu_frames = 400;
constexpr float nearest = 1e-3f, farthest = 1000.0f;

constexpr double never = std::numeric_limits<double>::infinity();

/// One way to make the picture, by arguments of the example.
class Way {
public:
    /// `frames`: of a turn on processors, after the first.
    Way(const char* arguments, uint32_t frames, const Device& device)
        : arguments_(arguments), frames_(frames), is_cpu_(device.getInfo().cpu) {}

    /// A turn; the best of all counts.
    void run() {
        // Several hundred on a GPU, as clocks rise under load alone.
        if (!is_cpu_) return keepLess(all_, run(gpu_frames).trace_ms);
        keepLess(first_, run(1).processor * 1e3);
        keepLess(all_, run(1 + frames_).processor * 1e3);
    }
    /// Milliseconds of a frame: by the device's clock, or, where the device is the processor, by the processor time of
    /// frames after the first, over the number of processors, so that what other programs do is left out.
    double ms(uint32_t threads) const { return is_cpu_ ? (all_ - first_) / (frames_ * threads) : all_; }

private:
    static void keepLess(double& best, double ms) { best = std::min(best, ms); }
    ExampleRun run(uint32_t frames) const {
        return runExample("06_hello_traversal",
                          fmt::format("--size {}x{} --time 0 --frames {} {}", width, height, frames, arguments_));
    }

    const char* arguments_;
    uint32_t frames_;
    bool is_cpu_;
    double first_ = never, all_ = never;
};

struct RaySets {
    std::vector<Ray> primary, reflection, shadow;
    size_t count() const { return primary.size() + reflection.size() + shadow.size(); }
};

/// The rays of a frame, as the shaders make them, in tiles of 4 x 4 pixels.
RaySets makeRays(const TraversalScene& scene, const test::EmbreeScene& embree, uint32_t threads) {
    const CameraParameters camera = TraversalScene::camera(0.0f, float(width) / height).parameters();
    RaySets rays;
    for (uint32_t i = 0; i < width * height; i++) {
        const uint32_t in_row = tile * width, in_tile = i % in_row % (tile * tile);
        const uint32_t x = i % in_row / (tile * tile) * tile + in_tile % tile, y = i / in_row * tile + in_tile / tile;
        const Vector4f direction =
            camera.ray_corner + camera.ray_x * ((x + 0.5f) / width) + camera.ray_y * ((y + 0.5f) / height);
        rays.primary.push_back({Vector3f(camera.position), 0.0f, glm::normalize(Vector3f(direction)), farthest});
    }
    std::vector<RayHit> hits(rays.primary.size());
    std::vector<uint32_t> instances(hits.size());
    embree.cast(rays.primary, hits, threads, instances);
    std::vector<Matrix4x4f> inverses;
    for (const TraversalScene::Instance& instance : scene.instances())
        inverses.push_back(glm::inverse(instance.transform.matrix()));
    const Vector3f light = TraversalScene::light(0.0f);
    for (size_t i = 0; i < hits.size(); i++) {
        if (instances[i] == UINT32_MAX) continue;
        const Mesh& mesh = scene.mesh(scene.instances()[instances[i]].mesh);
        const uint32_t* corners = &mesh.indices[3 * size_t{hits[i].primitive}];
        const Vector3f object = mesh.normals[corners[0]] * (1.0f - hits[i].u - hits[i].v) +
                                mesh.normals[corners[1]] * hits[i].u + mesh.normals[corners[2]] * hits[i].v;
        const Vector3f normal = glm::normalize(object * Matrix3x3f(inverses[instances[i]]));
        const Vector3f direction = rays.primary[i].direction;
        const Vector3f position = rays.primary[i].origin + direction * hits[i].t;
        rays.reflection.push_back(
            {position, nearest, direction - 2.0f * glm::dot(normal, direction) * normal, farthest});
        const Vector3f way = light - position;
        rays.shadow.push_back({position, nearest, glm::normalize(way), glm::length(way)});
    }
    return rays;
}

void run(Report& report) {
    const TraversalScene scene = *check(TraversalScene::load());
    std::vector<const Mesh*> meshes;
    for (uint32_t i = 0; i < TraversalScene::mesh_count; i++) meshes.push_back(&scene.mesh(i));
    std::vector<test::EmbreeInstance> places;
    for (const TraversalScene::Instance& instance : scene.instances())
        places.push_back({instance.mesh, instance.transform});
    const test::EmbreeScene embree(meshes, places, test::EmbreeMode::Robust);
    const uint32_t threads = std::max(std::thread::hardware_concurrency(), 1u);
    const RaySets rays = makeRays(scene, embree, threads);
    std::vector<RayHit> hits(rays.primary.size());
    std::vector<uint8_t> shadows(rays.shadow.size());

    const Device device = createDevice();
    const bool has_pipelines = static_cast<bool>(createPipelineDevice());
    Way driver("--tracing driver", 1, device), software("--tracing software", 5, device);
    Way queries("--query --tracing software", 5, device);
    // What is compiled stays in the driver's cache.
    for (const char* way : {"", "--query"})
        runExample("06_hello_traversal", fmt::format("--size 16x16 --tracing software {}", way));
    double theirs = never;
    for (uint32_t turn = 0; turn < turns; turn++) {
        if (has_pipelines) driver.run();
        software.run();
        queries.run();
        const double begin = processSeconds();
        embree.cast(rays.primary, hits, threads);
        embree.cast(rays.reflection, hits, threads);
        embree.castAny(rays.shadow, shadows, threads);
        theirs = std::min(theirs, (processSeconds() - begin) * 1e3 / threads);
    }
    const double pipeline = has_pipelines ? driver.ms(threads) : never, joined = software.ms(threads),
                 query = queries.ms(threads);
    const std::string against =
        fmt::format("{} single rays on {} threads, {}", test::embreeName(), threads, processorName());
    const std::string where = deviceName(device);
    const auto add = [&](const char* side, double ms, const std::string& other, const std::string& which) {
        if (ms == never) {
            fmt::print("  {} left out: {} has no ray-tracing pipelines\n", side, device.getInfo().name);
            return;
        }
        const double mrays = static_cast<double>(rays.count()) * 1e-3 / ms;
        fmt::print("  {:<9} {:9.2f} ms, {:8.2f} million rays a second\n", side, ms, mrays);
        report.add(fmt::format("traversal.hello.{}_ms", side), ms, "ms", other, which);
        report.add(fmt::format("traversal.hello.{}_mrays", side), mrays, "million rays a second", other, which);
    };
    fmt::print("  {} rays: {} of the camera, {} reflections, {} shadows\n", rays.count(), rays.primary.size(),
               rays.reflection.size(), rays.shadow.size());
    add("pipeline", pipeline, against, where);
    add("joined", joined, against, where);
    add("query", query, against, where);
    add("embree", theirs, "", processorName());
    report.add("traversal.hello.software_over_embree1", theirs / joined, "ratio of speeds", against, where);
    report.add("traversal.hello.query_over_embree1", theirs / query, "ratio of speeds", against, where);
    if (!has_pipelines) return;
    report.add("traversal.hello.driver_over_embree1", theirs / pipeline, "ratio of speeds", against, where);
    report.add(device.getInfo().cpu ? "traversal.hello.software_over_driver"
                                    : "traversal.gpu.hello.software_over_driver",
               pipeline / joined, "ratio of speeds", "the driver's pipeline", where);
}

}  // namespace

Benchmark traversalHelloBenchmark() {
    Benchmark benchmark = {{"traversal.hello.software_over_embree1", "traversal.hello.query_over_embree1",
                            "traversal.hello.driver_over_embree1", "traversal.hello.software_over_driver",
                            "traversal.gpu.hello.software_over_driver"},
                           run};
    for (const char* side : {"pipeline", "joined", "query", "embree"})
        for (const char* unit : {"ms", "mrays"})
            benchmark.figures.push_back(fmt::format("traversal.hello.{}_{}", side, unit));
    return benchmark;
}

}  // namespace glint::bench
