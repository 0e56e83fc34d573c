// tracing.gpu.{bunny,dragon,instances}.{camera,bounce}.software_over_pipeline: rays a second of Glint's own engine over
// those of the driver's ray-tracing pipeline, by the device's time stamps, in turns in one run.

#include "bench/tracing_pipeline.h"
#include "bench/tracing_scenes.h"
#include "support/hierarchies.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::bench {

namespace {

using detail::Hierarchy;
using detail::NodeForm;

constexpr uint32_t rounds = 9;
/// GPUs that idle at a fraction of their clock take so long to come up to it.
constexpr double warm_up_seconds = 0.5;

/// A kernel of batch.h over one set of rays.
class Batch {
public:
    struct Form {
        const char* name;
        std::string macros;
        uint32_t rays_per_thread = 1;
    };

    Batch(const Device& device, const Buffer& texels, const Buffer& rays, const Buffer& hits, uint32_t count,
          const Form& form, bool with_texels)
        : device_(device),
          kernel_(device_.createKernel()),
          query_(device_.createQuery(Query::TypeTime)),
          texels_(texels),
          rays_(rays),
          hits_(hits),
          count_(count),
          threads_((count + form.rays_per_thread - 1) / form.rays_per_thread),
          with_texels_(with_texels) {
        kernel_.createShaderGLSL("#include <glint/tracing/batch.h>\n", form.macros);
        check(kernel_.create());
    }

    /// Returns the seconds that the device took.
    double trace() {
        Compute compute = device_.createCompute();
        compute.setKernel(kernel_);
        compute.setUniform(0, std::array<uint32_t, 4>{count_, 0, 0, 0});
        if (with_texels_) {
            compute.setTexelBuffer(0, texels_, FormatRGBAu32);
            compute.setStorageBuffers(0, {rays_, hits_});
        } else {
            compute.setStorageBuffers(0, {texels_, rays_, hits_});
        }
        compute.beginQuery(query_);
        compute.dispatch(threads_);
        compute.endQuery(query_);
        check(device_.submit(compute));
        check(device_.finish());
        return static_cast<double>(*check(device_.getTime(query_))) * 1e-9;
    }

    std::vector<RayHit> hits() { return *check(device_.read<RayHit>(hits_, 0, count_)); }

private:
    Device device_;
    Kernel kernel_;
    Query query_;
    Buffer texels_, rays_, hits_;
    uint32_t count_;
    uint32_t threads_;
    bool with_texels_;
};

/// How far inside of a triangle a ray passes, in units of the world; negative outside.
double insideBy(const TracingScene& scene, const RayHit& hit, const Ray& ray) {
    const Vector3d direction = glm::normalize(Vector3d(ray.direction));
    const Vector3d helper = std::abs(direction.x) < 0.5 ? Vector3d(1, 0, 0) : Vector3d(0, 1, 0);
    const Vector3d x = glm::normalize(glm::cross(direction, helper));
    const Vector3d y = glm::cross(direction, x);
    double px[3];
    double py[3];
    for (size_t c = 0; c < 3; c++) {
        Vector3d corner(scene.mesh.positions[scene.mesh.indices[3 * size_t(hit.primitive) + c]]);
        if (!scene.instances.empty()) {
            const auto& m = scene.instances[hit.instance].rows;
            const Vector3d object = corner;
            for (int row = 0; row < 3; row++) {
                const float* r = &m[size_t(4 * row)];
                corner[row] = r[0] * object.x + r[1] * object.y + r[2] * object.z + r[3];
            }
        }
        px[c] = glm::dot(corner - Vector3d(ray.origin), x);
        py[c] = glm::dot(corner - Vector3d(ray.origin), y);
    }
    const double area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0]);
    double least = std::numeric_limits<double>::infinity();
    for (size_t c = 0; c < 3; c++) {
        const size_t n = (c + 1) % 3;
        const double edge = std::hypot(px[n] - px[c], py[n] - py[c]);
        least = std::min(least, std::copysign(1.0, area) * (px[c] * py[n] - px[n] * py[c]) / edge);
    }
    return least;
}

struct Differences {
    uint64_t primitives = 0;  ///< another triangle or none, on either side
    uint64_t apart = 0;       ///< of these, at distances that differ by more than 2^-13
    uint64_t wrong = 0;       ///< of these, where float64 says that ours are not the nearest
};

/// The driver's test of triangles is not known to be watertight, so rays at edges may differ. Ours moves corners by
/// 2^-20 of their distance from the origin (docs/tracing.md), and the way to an instance's space by as much again: it
/// is wrong if it misses a triangle nearer to the origin that a ray passes inside by more than twice that, or reports
/// one that it passes outside of by more.
Differences compare(const TracingScene& scene, std::span<const Ray> rays, std::span<const RayHit> ours,
                    std::span<const RayHit> theirs) {
    Differences differences;
    for (size_t i = 0; i < rays.size(); i++) {
        const RayHit& a = ours[i];
        const RayHit& b = theirs[i];
        if (a.primitive == b.primitive && a.instance == b.instance) continue;
        differences.primitives++;
        const double nearer = std::min(a.t, b.t);
        const double farther = std::max(a.t, b.t);
        if (farther - nearer <= 0x1p-13 * farther) continue;
        differences.apart++;
        const double distance = glm::length(Vector3d(rays[i].direction)) * nearer;
        const double reach = distance + glm::length(Vector3d(scene.mesh.bounds().size()));
        const double bound = 0x1p-18 * reach;
        const bool ours_is_nearer = a.t < b.t;
        const double inside = insideBy(scene, ours_is_nearer ? a : b, rays[i]);
        differences.wrong += (ours_is_nearer ? inside < -bound : inside > bound) ? 1 : 0;
    }
    return differences;
}

/// Everything that one scene needs on both sides.
class Race {
public:
    Race(const Device& device, RawDevice& raw, const TracingScene& scene)
        : device_(device), scene_(scene), is_cpu_(device.getInfo().cpu), capacity_(scene.camera.size()) {
        const NodeForm form = detail::nodeFormOf(is_cpu_);
        ThreadPool& pool = ThreadPool::shared();
        const Hierarchy hierarchy = test::hierarchyOf(scene.mesh, detail::BuildMode::Quality, &pool, form);
        const Buffer::Flags flags = is_cpu_ ? Buffer::FlagTexel : Buffer::FlagStorage;
        if (scene.instances.empty()) {
            texels_ = device_.createBuffer(flags, hierarchy.texels.data(), hierarchy.bytes());
        } else {
            const std::vector<detail::Texel> all = test::instancesOf(hierarchy, scene.instances, &pool);
            texels_ = device_.createBuffer(flags, std::span(all));
        }
        check(texels_);
        std::vector<Transform3x4> places = scene.instances;
        if (places.empty()) places.emplace_back(Matrix4x4f(1.0f));
        pipeline_ = std::make_unique<TracingPipeline>(raw, scene.mesh, places, capacity_);
        macros_ = fmt::format("GLINT_TRACING_MEMORY={};GLINT_TRACING_NODES={};GLINT_TRACING_LEVELS={};",
                              is_cpu_ ? 0 : 1, static_cast<int>(form), scene.instances.empty() ? 1 : 2);
    }

    /// Returns the ratio of the first kernel's rays a second to the pipeline's.
    double run(const char* kind, std::span<const Ray> rays, std::span<const Batch::Form> forms) {
        const Buffer ray_buffer = device_.createBuffer(Buffer::FlagStorage, rays);
        const Buffer hit_buffer = device_.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(RayHit));
        const auto count = static_cast<uint32_t>(rays.size());
        std::vector<Batch> batches;
        for (Batch::Form form : forms) {
            form.macros = macros_ + form.macros;
            batches.emplace_back(device_, texels_, ray_buffer, hit_buffer, count, form, is_cpu_);
        }
        pipeline_->setRays(rays);
        // The driver compiles at the first dispatch, which does not count.
        for (Batch& batch : batches) batch.trace();
        pipeline_->trace();
        const double begin = wallSeconds();
        while (!is_cpu_ && wallSeconds() - begin < warm_up_seconds) pipeline_->trace();
        std::vector<Times> times(batches.size() + 1);
        for (uint32_t round = 0; round < (is_cpu_ ? 1 : rounds); round++) {
            times[0].values.push_back(pipeline_->trace());
            for (size_t i = 0; i < batches.size(); i++) times[i + 1].values.push_back(batches[i].trace());
        }

        const double million = static_cast<double>(count) * 1e-6;
        fmt::print("  {} {}, {} rays, million a second\n", scene_.name, kind, count);
        fmt::print("    {:<20} {:9.2f}\n", "pipeline", million / times[0].median());
        const std::vector<RayHit> theirs = pipeline_->hits();
        for (size_t i = 0; i < batches.size(); i++) {
            device_.clearBuffer(hit_buffer, 0x12345678u);
            batches[i].trace();
            const Differences differences = compare(scene_, rays, batches[i].hits(), theirs);
            fmt::print("    {:<20} {:9.2f}  {:.3f}; {} other triangles, {} at other distances, {} wrong\n",
                       forms[i].name, million / times[i + 1].median(), times[0].median() / times[i + 1].median(),
                       differences.primitives, differences.apart, differences.wrong);
            if (differences.wrong != 0) throw std::runtime_error("the engine's hits are not the nearest ones");
        }
        std::fflush(stdout);
        return times[0].median() / times[1].median();
    }

private:
    Device device_;
    const TracingScene& scene_;
    bool is_cpu_;
    size_t capacity_;
    Buffer texels_;
    std::unique_ptr<TracingPipeline> pipeline_;
    std::string macros_;
};

void run(Report& report) {
    const Device device = createDevice();
    if (!device.getFeatures().rayTracing) {
        fmt::print("  left out: {} has no ray-tracing pipelines\n\n", device.getInfo().name);
        return;
    }
    // As many rays as fill a GPU; a thousandth of them where one ray may take a tenth of a millisecond.
    const uint32_t size = device.getInfo().cpu ? 128 : 4096;
    const Batch::Form plain = {"one ray a lane", "GLINT_TRACING_REFILL=0"};
    const Batch::Form refilling = {"refilling", "GLINT_TRACING_REFILL=1;GLINT_TRACING_RAYS=16", 16};
    for (const char* name : {"bunny", "dragon", "instances"}) {
        const std::string figure = fmt::format("tracing.gpu.{}.", name);
        const std::string& filter = report.options().filter;
        if ((figure + "camera.software_over_pipeline").find(filter) == std::string::npos &&
            (figure + "bounce.software_over_pipeline").find(filter) == std::string::npos)
            continue;
        if (name == std::string("dragon") && dragonPath().empty()) {
            fmt::print("  dragon left out: GLINT_DRAGON does not say where its file is (docs/tracing.md)\n");
            continue;
        }
        const TracingScene scene = makeTracingScene(name, size);
        RawDevice raw(device.getInfo().name, RawDevice::Tracing::Pipelines);
        Race race(device, raw, scene);
        // Bounces leave lanes idle, camera rays do not.
        std::vector<Batch::Form> camera = {plain};
        std::vector<Batch::Form> bounce = {plain};
        if (scene.instances.empty()) {
            camera.push_back(refilling);
            bounce.insert(device.getInfo().cpu ? bounce.end() : bounce.begin(), refilling);
        }
        const std::string against = fmt::format("the driver's ray-tracing pipeline, {} x {} rays", size, size);
        report.add(figure + "camera.software_over_pipeline", race.run("camera", scene.camera, camera), "ratio", against,
                   deviceName(device));
        report.add(figure + "bounce.software_over_pipeline", race.run("bounce", scene.bounce, bounce), "ratio", against,
                   deviceName(device));
    }
}

}  // namespace

Benchmark tracingGpuBenchmark() {
    return {{"tracing.gpu.bunny.camera.software_over_pipeline", "tracing.gpu.bunny.bounce.software_over_pipeline",
             "tracing.gpu.dragon.camera.software_over_pipeline", "tracing.gpu.dragon.bounce.software_over_pipeline",
             "tracing.gpu.instances.camera.software_over_pipeline",
             "tracing.gpu.instances.bounce.software_over_pipeline"},
            run};
}

}  // namespace glint::bench
