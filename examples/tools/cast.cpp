// glint cast: rays in, hits out, as NumPy arrays of any length.

#include "progress.h"
#include "tool.h"

#include <glint/base/file.h>
#include <glint/format/mesh_scene.h>
#include <glint/format/npy.h>
#include <glint/graphics/ray_caster.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::filesystem::path scene;
    std::filesystem::path rays;
    std::filesystem::path hits;
    std::filesystem::path stats;
    std::string adapter;
    std::string api;
    TracingEngine tracing = TracingEngine::Auto;
    uint32_t mask = 0xff;
    bool any = false;
};

/// Adds the time of a scope.
class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds), begin_(now()) {}
    ~Stopwatch() { seconds_ += now() - begin_; }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    double begin_;
};

struct Seconds {
    double load = 0.0, build = 0.0, cast = 0.0, read = 0.0, write = 0.0;
};

NpyHeader hitHeader(bool any, uint64_t count) {
    if (any) return {{NpyField::of<bool>()}, {count}};
    return {{NpyField::of<float>("t"), NpyField::of<uint32_t>("primitive"), NpyField::of<uint32_t>("geometry"),
             NpyField::of<float>("u"), NpyField::of<float>("v"), NpyField::of<bool>("front"), NpyField::padding(3),
             NpyField::of<uint32_t>("instance")},
            {count}};
}
// A hit's `front` is 0 or 1: its first byte is the bool and its others are the padding.
static_assert(sizeof(RayHit) == 28 && offsetof(RayHit, front) == 20 && std::endian::native == std::endian::little);

Expected<NpyReader> openRays(const std::filesystem::path& path) {
    Expected<NpyReader> reader = NpyReader::open(path);
    if (!reader) return reader;
    const NpyHeader& header = reader->header();
    const bool is_float = header.fields == std::vector{NpyField::of<float>()};
    if (!is_float || header.shape.size() != 2 || header.shape[1] != 8)
        return unexpected(Error::inFile(
            ErrorCode::InvalidArgument, "tool.rays",
            fmt::format("rays are float32 [N, 8] (origin, tmin, direction, tmax), not {}", describe(header)),
            path.string(), 0));
    return reader;
}

struct Outcome {
    uint64_t rays = 0;
    uint64_t hits = 0;
    uint64_t triangles = 0;  ///< of all meshes
    uint64_t instances = 0;
    uint64_t tracing_bytes = 0;
    DeviceInfo info;
    TracingEngine engine = TracingEngine::Driver;
    Seconds seconds;
};

Status writeStatistics(const Options& options, const Outcome& outcome) {
    const Seconds& seconds = outcome.seconds;
    const auto rays = static_cast<double>(outcome.rays);
    const nlohmann::ordered_json json = {
        {"scene", options.scene.string()},
        {"triangles", outcome.triangles},
        {"instances", outcome.instances},
        {"any", options.any},
        {"rays", outcome.rays},
        {"hits", outcome.hits},
        {"hit_share", outcome.rays ? static_cast<double>(outcome.hits) / rays : 0.0},
        {"rays_per_second", outcome.rays ? rays / seconds.cast : 0.0},
        {"seconds",
         {{"load", seconds.load},
          {"build", seconds.build},
          {"cast", seconds.cast},
          {"read", seconds.read},
          {"write", seconds.write}}},
        {"tracing_bytes", outcome.tracing_bytes},
        {"tracing", toString(outcome.engine)},
        {"tracing_reason", outcome.info.tracing},
        {"adapter", outcome.info.name},
        {"driver", outcome.info.driver},
        {"api", outcome.info.api + " " + outcome.info.version},
    };
    return writeTextFile(options.stats,
                         json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

/// Streams all rays through the device into the file of hits.
Status castAll(const Options& options, RayCaster& caster, NpyReader& reader, Outcome& outcome) {
    outcome.rays = reader.header().shape[0];
    Expected<NpyWriter> writer = NpyWriter::create(options.hits, hitHeader(options.any, outcome.rays));
    if (!writer) return writer.error();
    Progress progress(outcome.rays, "million rays", 1e-6);
    uint64_t done = 0;

    const auto fetch = [&](std::span<Ray> rays) -> Expected<uint64_t> {
        if (Status status = checkInterrupt(); !status) return unexpected(status.error());
        const Stopwatch watch(outcome.seconds.read);
        const Expected<uint64_t> numbers = reader.read(std::as_writable_bytes(rays));
        return numbers ? *numbers / 8 : numbers;
    };
    const auto store = [&](auto hits, auto&& isHit) {
        const Stopwatch watch(outcome.seconds.write);
        for (const auto& hit : hits) outcome.hits += isHit(hit);
        done += hits.size();
        progress.update(done);
        return writer->write(std::as_bytes(hits));
    };
    const Status status = options.any ? caster.castAny(fetch,
                                                       [&](std::span<const uint8_t> hits) {
                                                           return store(hits, [](uint8_t hit) { return hit; });
                                                       })
                                      : caster.cast(fetch, [&](std::span<const RayHit> hits) {
                                            return store(hits, [](const RayHit& hit) { return hit.isHit(); });
                                        });
    if (!status) return status;
    if (Status late = checkInterrupt(); !late) return late;
    return writer->close();
}

/// What rays are cast at: a scene of meshes, or one mesh that stands where it is.
struct Target {
    std::vector<Mesh> meshes;
    std::vector<MeshInstance> instances;
};

Expected<Target> loadTarget(const std::filesystem::path& path) {
    Target target;
    if (path.extension() == ".json") {
        Expected<MeshScene> scene = MeshScene::load(path);
        if (!scene) return unexpected(scene.error());
        Expected<std::vector<Mesh>> meshes = scene->loadMeshes();
        if (!meshes) return unexpected(meshes.error());
        target.meshes = std::move(*meshes);
        target.instances = std::move(scene->instances);
        return target;
    }
    Expected<Mesh> mesh = Mesh::load(path);
    if (!mesh) return unexpected(mesh.error());
    target.meshes.push_back(std::move(*mesh));
    target.instances.emplace_back();
    return target;
}

Expected<RayCaster> createCaster(const Options& options, Outcome& outcome) {
    std::optional<Expected<Target>> target;
    {
        const Stopwatch watch(outcome.seconds.load);
        target = loadTarget(options.scene);
    }
    if (!*target) return unexpected(target->error());
    for (const Mesh& mesh : (*target)->meshes) outcome.triangles += mesh.triangleCount();
    outcome.instances = (*target)->instances.size();

    const Stopwatch watch(outcome.seconds.build);
    const Device device = openDevice({.api = options.api,
                                      .adapter = options.adapter,
                                      .required = FeatureComputeTracing,
                                      .optional = FeatureTimestamps,
                                      .tracing = options.tracing});
    if (!device) return unexpected(device.error());
    outcome.info = device.getInfo();
    outcome.engine = device.getFeatures().tracingEngine;
    Expected<RayCaster> caster = RayCaster::create(device, (*target)->meshes, (*target)->instances);
    if (!caster) return caster;
    caster->setMask(static_cast<uint8_t>(options.mask));
    outcome.tracing_bytes = caster->getMemory();
    return caster;
}

Expected<Outcome> cast(const Options& options) {
    Outcome outcome;
    Expected<NpyReader> reader = openRays(options.rays);
    if (!reader) return unexpected(reader.error());
    Expected<RayCaster> caster = createCaster(options, outcome);
    if (!caster) return unexpected(caster.error());
    if (Status status = checkInterrupt(); !status) return unexpected(status.error());
    {
        const Stopwatch watch(outcome.seconds.cast);
        if (Status status = castAll(options, *caster, *reader, outcome); !status) return unexpected(status.error());
    }
    if (!options.stats.empty())
        if (Status status = writeStatistics(options, outcome); !status) return unexpected(status.error());
    return outcome;
}

int run(const Options& options) {
    catchSignals();
    const Expected<Outcome> outcome = cast(options);
    if (!outcome) {
        const int status = fail("cast", outcome.error());
        return outcome.error().id() == "tool.interrupted" ? ExitInterrupted : status;
    }
    const Seconds& seconds = outcome->seconds;
    const auto rays = static_cast<double>(outcome->rays);
    fmt::print("{} rays, {} hits ({:.2f} %), {} triangles, {}\n", outcome->rays, outcome->hits,
               outcome->rays ? static_cast<double>(outcome->hits) / rays * 100 : 0.0, outcome->triangles,
               outcome->info.name);
    fmt::print(
        "{:.3f} million rays a second; load {:.2f} s, build {:.2f} s, cast {:.2f} s (read {:.2f} s, write {:.2f} s)\n",
        outcome->rays ? rays / seconds.cast * 1e-6 : 0.0, seconds.load, seconds.build, seconds.cast, seconds.read,
        seconds.write);
    return 0;
}

}  // namespace

Command castCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* sub = app.add_subcommand("cast", "Casts rays at a mesh or a scene of meshes: closest hits, or occlusion");
    sub->add_option("SCENE", options->scene,
                    "Mesh of triangles (.obj, .ply, .gltf, .glb), or instances of such (.json)")
        ->required();
    sub->add_option("RAYS", options->rays, "Rays: float32 [N, 8] as .npy: origin, tmin, direction, tmax")->required();
    sub->add_option("HITS", options->hits,
                    "Where to write the hits: [N] as .npy, of t, primitive, geometry, u, v, front, instance")
        ->required();
    sub->add_flag("--any", options->any, "Write whether each ray hits anything: bool [N]");
    sub->add_option("--mask", options->mask, "See instances whose mask shares a bit with this one: 0 to 255")
        ->type_name("N")
        ->check(CLI::Range(0u, 255u));
    sub->add_option("--stats", options->stats, "Write times and counts to this file")->type_name("FILE.json");
    addDevice(*sub, options->adapter, options->api);
    addTracing(*sub, options->tracing);
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
