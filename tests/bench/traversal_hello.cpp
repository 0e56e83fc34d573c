// traversal.hello.{pipeline,query,embree}_{ms,mrays}: a frame of 06_hello_traversal at 1600 x 900, through the driver's
// ray-tracing pipeline and by ray queries, as the example itself measures them, and the same rays through Embree, one
// at a time on all processors. Each the best of some turns; on processors by processor time over the number of them.

#include "06_hello_traversal/scene.h"
#include "accuracy/embree.h"
#include "bench/tracing_batch.h"
#include "support/files.h"

#include <glint/base/file.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <thread>

namespace glint::bench {

namespace {

constexpr uint32_t width = 1600, height = 900, tile = 4;
constexpr uint32_t turns = 2, gpu_frames = 100, cpu_frames = 2;
constexpr float nearest = 1e-3f, farthest = 1000.0f;

/// Seconds that the programs started so far have spent on processors.
double childSeconds() {
    rusage usage = {};
    getrusage(RUSAGE_CHILDREN, &usage);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct ExampleTimes {
    double device = 0.0;  ///< milliseconds of the fastest frame
    double process = 0.0;
};

ExampleTimes runExample(const std::string& arguments, uint32_t frames, const test::TempDir& folder) {
    const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path example = programs.parent_path() / "examples" / "06_hello_traversal";
    if (!std::filesystem::exists(example)) throw std::runtime_error(example.string() + " has not been built");
    const std::string stats = folder / "stats.json";
    const std::string command =
        fmt::format("'{}' --size {}x{} --time 0 --frames {} --stats '{}' {} > '{}'", example.string(), width, height,
                    frames, stats, arguments, (folder / "output").string());
    const double begin = childSeconds();
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
    const double seconds = childSeconds() - begin;
    const auto json = nlohmann::json::parse(check(readTextFile(stats)).value());
    return {json.at("passes").at(0).at("min_ns").get<double>() * 1e-6, seconds};
}

/// Milliseconds of a frame: by the device's clock, or, where the device is the processor, by the processor time of
/// frames after the first, so that what other programs do is left out.
double traceExample(const std::string& arguments, const Device& device, uint32_t threads, const test::TempDir& folder) {
    if (!device.getInfo().cpu) return runExample(arguments, gpu_frames, folder).device;
    const double first = runExample(arguments, 1, folder).process;
    return (runExample(arguments, 1 + cpu_frames, folder).process - first) * 1e3 / (cpu_frames * threads);
}

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
    const test::TempDir folder;
    constexpr double never = std::numeric_limits<double>::infinity();
    double pipeline = never, query = never, theirs = never;
    for (uint32_t turn = 0; turn < turns; turn++) {
        if (device.getFeatures().rayTracing) pipeline = std::min(pipeline, traceExample("", device, threads, folder));
        query = std::min(query, traceExample("--query", device, threads, folder));
        const double begin = processSeconds();
        embree.cast(rays.primary, hits, threads);
        embree.cast(rays.reflection, hits, threads);
        embree.castAny(rays.shadow, shadows, threads);
        theirs = std::min(theirs, (processSeconds() - begin) * 1e3 / threads);
    }
    const std::string against =
        fmt::format("{} single rays on {} threads, {}", test::embreeName(), threads, processorName());
    const auto add = [&](const char* side, double ms, const std::string& other, const std::string& where) {
        if (ms == never) {
            fmt::print("  {} left out: {} has no ray-tracing pipelines\n", side, device.getInfo().name);
            return;
        }
        const double mrays = static_cast<double>(rays.count()) * 1e-3 / ms;
        fmt::print("  {:<9} {:9.2f} ms, {:8.2f} million rays a second\n", side, ms, mrays);
        report.add(fmt::format("traversal.hello.{}_ms", side), ms, "ms", other, where);
        report.add(fmt::format("traversal.hello.{}_mrays", side), mrays, "million rays a second", other, where);
    };
    fmt::print("  {} rays: {} of the camera, {} reflections, {} shadows\n", rays.count(), rays.primary.size(),
               rays.reflection.size(), rays.shadow.size());
    add("pipeline", pipeline, against, deviceName(device));
    add("query", query, against, deviceName(device));
    add("embree", theirs, "", processorName());
}

}  // namespace

Benchmark traversalHelloBenchmark() {
    Benchmark benchmark = {{}, run};
    for (const char* side : {"pipeline", "query", "embree"})
        for (const char* unit : {"ms", "mrays"})
            benchmark.figures.push_back(fmt::format("traversal.hello.{}_{}", side, unit));
    return benchmark;
}

}  // namespace glint::bench
