// traversal.wavefront.LOAD.{compacted,sorted}.over_one_kernel: speed of kernels with queues between them over that of a
// Traversal whose stages are joined into one, in pictures that agree. LOAD: the rays of 06_hello_traversal (coherent),
// paths of eight diffuse rays through its scene under a ceiling (incoherent), and the same with Russian roulette
// (roulette). Compacted: a kernel searches, one shades, and a scan closes the gaps in the queue. Sorted: before they
// are shaded, a sort puts the rays of a hit group side by side, and each group has a kernel of its own. On processors
// by processor time of all threads, on GPUs by the device's clock, there also at 3840 x 2160 (.4k).

#include "06_hello_traversal/scene.h"
#include "bench/example_runs.h"
#include "bench/tracing_batch.h"
#include "support/files.h"

#include <glint/device/traversal.h>
#include <glint/format/image.h>
#include <glint/parallel/prefix_scan.h>
#include <glint/parallel/radix_sort.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>

namespace glint::bench {

namespace {

constexpr uint32_t path_bytes = 64, hit_bytes = 24, plan_bytes = 144, searches_offset = 128;
constexpr uint32_t sort_offset = 16, scan_offset = 32, groups_offset = 48, groups_stride = 16, group_count = 4;
constexpr uint32_t group_bits = 2;
constexpr uint32_t cpu_rounds = 5, gpu_rounds = 15;
constexpr double warm_up_seconds = 0.5;
// Paths of a thread that is refilled: on GPUs few enough for all of their threads to have some.
constexpr uint32_t cpu_refill = 16, gpu_refill = 4;

struct Load {
    const char* name;
    bool is_coherent;
    bool has_roulette;
    uint32_t most_rays;
    uint32_t cpu_width, cpu_height;
};
constexpr Load loads[] = {{"coherent", true, false, 2, 1280, 720},
                          {"incoherent", false, false, 8, 640, 360},
                          {"roulette", false, true, 8, 640, 360}};
constexpr const char* forms[] = {"compacted", "sorted", "refilled"};

std::string figureOf(const Load& load, const char* form, const char* size) {
    return fmt::format("traversal.wavefront.{}.{}{}.over_one_kernel", load.name, form, size);
}

struct Parameters {
    CameraParameters camera;
    Vector4f light = Vector4f(0.0f);
    Vector4u first_vertex = Vector4u(0u);
    Vector4u first_index = Vector4u(0u);
};

struct Settings {
    uint32_t width, height, most_rays, roulette;
};

struct Place {
    Vector4f to_object[3];
    Vector4u mesh;
};

/// The scene of 06 on a device, as its shaders want it, and what the bench's own want beside it.
struct Scene {
    Parameters parameters;
    Buffer vertices, indices, places;
    std::vector<Tracing> tracings;  ///< of the meshes, and the scene

    Scene(Device& device, bool has_ceiling) {
        const TraversalScene source = *check(TraversalScene::load());
        std::vector<Vector3f> vertex_data;
        std::vector<uint32_t> index_data;
        for (uint32_t i = 0; i < TraversalScene::mesh_count; i++) {
            const Mesh& mesh = source.mesh(i);
            parameters.first_vertex[static_cast<int>(i)] = static_cast<uint32_t>(vertex_data.size() / 2);
            parameters.first_index[static_cast<int>(i)] = static_cast<uint32_t>(index_data.size());
            for (size_t k = 0; k < mesh.positions.size(); k++)
                vertex_data.insert(vertex_data.end(), {mesh.positions[k], mesh.normals[k]});
            index_data.insert(index_data.end(), mesh.indices.begin(), mesh.indices.end());
        }
        vertices = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, std::span(vertex_data));
        indices = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, std::span(index_data));
        for (uint32_t i = 0; i < TraversalScene::mesh_count; i++) {
            constexpr uint32_t stride = 2 * sizeof(Vector3f);
            const Mesh& mesh = source.mesh(i);
            Tracing tracing = device.createTracing();
            tracing.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, stride, vertices,
                                    uint64_t{parameters.first_vertex[static_cast<int>(i)]} * stride);
            tracing.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32, indices,
                                   uint64_t{parameters.first_index[static_cast<int>(i)]} * sizeof(uint32_t));
            check(tracing.create(Tracing::TypeTriangle));
            tracings.push_back(tracing);
        }
        std::vector<TraversalScene::Instance> instances = source.instances();
        constexpr float ceiling = 12.0f;
        if (has_ceiling)
            instances.push_back({TraversalScene::mesh_plane, Transform3x4(translate({0.0f, 0.0f, ceiling}))});
        std::vector<Place> place_data;
        std::vector<Tracing::Instance> tracing_instances;
        for (const TraversalScene::Instance& instance : instances) {
            const Matrix4x4f inverse = glm::inverse(instance.transform.matrix());
            place_data.push_back({{inverse[0], inverse[1], inverse[2]}, Vector4u(instance.mesh)});
            Tracing::Instance& added = tracing_instances.emplace_back();
            std::copy(instance.transform.rows.begin(), instance.transform.rows.end(), added.transform);
            added.tracing = &tracings[instance.mesh];
            added.offset = instance.mesh;
        }
        places = device.createBuffer(Buffer::FlagStorage, std::span(place_data));
        tracings.push_back(check(device.createTracing(tracing_instances)));
        check(device.buildTracings(tracings, Buffer()));
        parameters.light = Vector4f(TraversalScene::light(0.0f), 1.0f);
    }
};

/// What the forms have in common: where they draw, and how they are timed.
class Form {
public:
    Form(Device& device, const Scene& scene, const Load& load, uint32_t width, uint32_t height)
        : device_(device), scene_(scene), load_(load), parameters_(scene.parameters), width_(width), height_(height) {
        parameters_.camera = TraversalScene::camera(0.0f, float(width) / float(height)).parameters();
        picture_ = device_.createTexture2D(FormatRGBAu8n, width, height, Texture::FlagSurface);
        check(picture_);
        query_ = device_.createQuery(Query::TypeTime);
    }
    virtual ~Form() = default;
    Form(const Form&) = delete;
    Form& operator=(const Form&) = delete;

    /// Seconds of a frame.
    double draw() {
        const bool is_cpu = device_.getInfo().cpu;
        const double begin = processSeconds();
        Compute compute = device_.createCompute();
        if (!is_cpu) compute.beginQuery(query_);
        record(compute);
        if (!is_cpu) compute.endQuery(query_);
        check(device_.submit(compute));
        check(device_.finish());
        return is_cpu ? processSeconds() - begin : static_cast<double>(check(device_.getTime(query_)).value()) * 1e-9;
    }
    Image picture() {
        Image image = *check(Image::create(FormatRGBAu8n, width_, height_));
        check(device_.getTexture(picture_, image.bytes().data(), image.bytes().size()));
        return image;
    }
    /// Milliseconds of the parts of a frame, by the device's clock.
    virtual std::string parts() { return {}; }

protected:
    virtual void record(Compute& compute) = 0;
    /// For shaders that include 06's; those of the bench have more, those of 06 do not.
    void bind(Compute& compute, bool has_settings) {
        compute.setUniform(0, parameters_);
        compute.setStorageBuffers(0, {scene_.vertices, scene_.indices});
        compute.setTracing(0, scene_.tracings.back());
        compute.setSurfaceTexture(0, picture_);
        if (!has_settings) return;
        compute.setUniform(1, Settings{width_, height_, load_.most_rays, load_.has_roulette ? 1u : 0u});
        compute.setStorageBuffer(2, scene_.places);
    }
    std::string shader() const {
        if (!load_.is_coherent) return GLINT_SOURCE_DIR "/tests/bench/traversal_wavefront.shader";
        return GLINT_SOURCE_DIR "/examples/06_hello_traversal/main.shader";
    }

    Device device_;
    const Scene& scene_;
    Load load_;
    Parameters parameters_;
    uint32_t width_, height_;
    Texture picture_;
    Query query_;
};

/// One kernel, or the driver's pipeline.
class OneKernel : public Form {
public:
    enum Kind : uint8_t { Stages, Queries, Refilled };

    OneKernel(Device& device, const Scene& scene, const Load& load, uint32_t width, uint32_t height, Kind kind)
        : Form(device, scene, load, width, height) {
        if (kind != Stages) {
            const uint32_t refill = device.getInfo().cpu ? cpu_refill : gpu_refill;
            std::string macros = load.is_coherent ? "QUERY_SHADER=1;RECURSION_DEPTH=2" : "PATH_QUERY=1";
            if (kind == Refilled) {
                macros = fmt::format("REFILL={}", refill);
                const uint64_t group = uint64_t{64} * refill;
                threads_ = (uint64_t{width} * height + group - 1) / group * 64;
            }
            kernel_ = device_.createKernel();
            kernel_.loadShaderGLSL(shader(), macros);
            check(kernel_.create());
            return;
        }
        traversal_ = device_.createTraversal();
        const auto add = [&](Shader::Type type, const char* macros) {
            traversal_.loadShaderGLSL(type, shader(), fmt::format("{};RECURSION_DEPTH=2", macros));
        };
        const auto addHits = [&](const char* macro) {
            for (const char* mesh : {"mesh_model", "mesh_dodecahedron", "mesh_plane"})
                add(Shader::TypeClosest, fmt::format("{}=1;MESH={}", macro, mesh).c_str());
        };
        if (load.is_coherent) {
            add(Shader::TypeRayGen, "RAYGEN_SHADER=1");
            add(Shader::TypeRayMiss, "PRIMARY_MISS_SHADER=1");
            add(Shader::TypeRayMiss, "REFLECTION_MISS_SHADER=1");
            add(Shader::TypeRayMiss, "SHADOW_MISS_SHADER=1");
            addHits("PRIMARY_SHADER");
            addHits("REFLECTION_SHADER");
        } else {
            add(Shader::TypeRayGen, "PATH_RAYGEN=1");
            add(Shader::TypeRayMiss, "PATH_MISS=1");
            addHits("PATH_CLOSEST");
        }
        traversal_.setRecursionDepth(load.is_coherent ? 2 : 1);
        check(traversal_.create());
    }

protected:
    void record(Compute& compute) override {
        if (kernel_)
            compute.setKernel(kernel_);
        else
            compute.setTraversal(traversal_);
        bind(compute, !load_.is_coherent);
        if (threads_ != 0)
            compute.dispatch(threads_);
        else
            compute.dispatch(picture_);
    }

private:
    Kernel kernel_;
    Traversal traversal_;
    uint64_t threads_ = 0;  // 0: one for each pixel
};

class Wavefront : public Form {
public:
    Wavefront(Device& device, const Scene& scene, const Load& load, uint32_t width, uint32_t height, bool is_sorted)
        : Form(device, scene, load, width, height), is_sorted_(is_sorted) {
        const uint64_t pixels = uint64_t{width} * height;
        if (width % 8 != 0 || height % 4 != 0) throw std::runtime_error("pictures are made of tiles of 8 x 4 pixels");
        paths_ = device_.createBuffer(Buffer::FlagStorage, pixels * path_bytes);
        hits_ = device_.createBuffer(Buffer::FlagStorage, pixels * hit_bytes);
        for (Buffer& queue : queues_) queue = device_.createBuffer(Buffer::FlagStorage, 2 * pixels * sizeof(uint32_t));
        alive_ = device_.createBuffer(Buffer::FlagStorage, (pixels + 1) * sizeof(uint32_t));
        plan_ = device_.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, plan_bytes);
        check(scan_.create(device_, PrefixScan::ModeSingle));
        if (is_sorted) check(sort_.create(device_, RadixSort::FlagSingle, static_cast<uint32_t>(pixels)));
        for (const char* step : {"GENERATE", "SEARCH", "SHADOW", "GROUPS", "COMPACT", "PLAN", "RESOLVE"})
            kernels_[step] = makeKernel(step, "");
        if (!is_sorted) kernels_["SHADE"] = makeKernel("SHADE", "");
        for (uint32_t i = 0; is_sorted && i < group_count; i++)
            kernels_[fmt::format("SHADE {}", i)] = makeKernel("SHADE", fmt::format(";GROUP={}u", i));
    }

    std::string parts() override {
        queries_.clear();
        is_measured_ = true;
        draw();
        is_measured_ = false;
        std::map<std::string, double> times;
        for (const auto& [step, query] : queries_)
            times[step] += static_cast<double>(check(device_.getTime(query)).value()) * 1e-6;
        const uint32_t searches = check(device_.read<uint32_t>(plan_, searches_offset, 1))->front();
        std::string text = fmt::format("{} closest hits:", searches);
        for (const auto& [step, ms] : times) text += fmt::format(" {} {:.2f}", step, ms);
        return text;
    }

protected:
    void record(Compute& compute) override {
        Buffer queue = queues_[0], next = queues_[1];
        const auto run = [&](const std::string& step, const char* part, std::optional<uint64_t> counts) {
            timed(compute, part, [&] {
                compute.setKernel(kernels_.at(step));
                bind(compute, true);
                compute.setStorageBuffers(3, {paths_, hits_, queue, next, alive_, plan_});
                if (counts)
                    compute.dispatchIndirect(plan_, *counts);
                else
                    compute.dispatch(uint64_t{width_} * height_);
            });
        };
        const auto runOne = [&](const char* step, const char* part) {
            timed(compute, part, [&] {
                compute.setKernel(kernels_.at(step));
                bind(compute, true);
                compute.setStorageBuffers(3, {paths_, hits_, queue, next, alive_, plan_});
                compute.dispatch(1);
            });
        };
        run("GENERATE", "generate", std::nullopt);
        for (uint32_t ray = 0; ray < load_.most_rays; ray++) {
            if (load_.is_coherent && ray == 1) run("SHADOW", "search", 0);
            run("SEARCH", "search", 0);
            if (is_sorted_) {
                timed(compute, "sort", [&] { sort_.dispatchIndirect(compute, queue, plan_, sort_offset, group_bits); });
                runOne("GROUPS", "sort");
                for (uint32_t i = 0; i < group_count; i++)
                    run(fmt::format("SHADE {}", i), "shade", groups_offset + uint64_t{i} * groups_stride);
            } else {
                run("SHADE", "shade", 0);
            }
            if (ray + 1 == load_.most_rays) break;
            timed(compute, "compact", [&] { scan_.dispatchIndirect(compute, alive_, plan_, scan_offset); });
            run("COMPACT", "compact", 0);
            runOne("PLAN", "compact");
            std::swap(queue, next);
        }
        run("RESOLVE", "generate", std::nullopt);
    }

private:
    Kernel makeKernel(const char* step, const std::string& macros) {
        Kernel kernel = device_.createKernel(step);
        kernel.loadShaderGLSL(
            GLINT_SOURCE_DIR "/tests/bench/traversal_wavefront.shader",
            fmt::format("{}=1;COHERENT={};SORTED={}{}", step, load_.is_coherent ? 1 : 0, is_sorted_ ? 1 : 0, macros));
        check(kernel.create());
        return kernel;
    }
    template <class Work>
    void timed(Compute& compute, const char* part, const Work& work) {
        if (is_measured_) compute.beginQuery(queries_.emplace_back(part, device_.createQuery(Query::TypeTime)).second);
        work();
        if (is_measured_) compute.endQuery(queries_.back().second);
    }

    bool is_sorted_;
    bool is_measured_ = false;
    Buffer paths_, hits_, queues_[2], alive_, plan_;
    PrefixScan scan_;
    RadixSort sort_;
    std::map<std::string, Kernel> kernels_;
    std::vector<std::pair<std::string, Query>> queries_;
};

/// Pixels with a channel that differs by more than `threshold` of 255.
size_t differences(const Image& a, const Image& b, int threshold) {
    size_t count = 0;
    for (size_t i = 0; i < a.bytes().size(); i += 4) {
        int most = 0;
        for (size_t k = 0; k < 4; k++)
            most = std::max(most, std::abs(static_cast<int>(a.bytes()[i + k]) - static_cast<int>(b.bytes()[i + k])));
        count += most > threshold ? 1 : 0;
    }
    return count;
}

/// Medians of a GPU's times, the smallest of a processor's.
std::vector<double> timesOf(std::span<const std::unique_ptr<Form>> sides, bool is_cpu, uint32_t rounds) {
    // What is compiled at the first dispatch does not count.
    for (const auto& side : sides) side->draw();
    const double begin = wallSeconds();
    while (!is_cpu && wallSeconds() - begin < warm_up_seconds)
        for (const auto& side : sides) side->draw();
    std::vector<Times> times(sides.size());
    for (uint32_t round = 0; round < rounds; round++)
        for (size_t i = 0; i < sides.size(); i++) times[i].values.push_back(sides[i]->draw());
    std::vector<double> result;
    for (const Times& each : times) result.push_back(is_cpu ? each.minimum() : each.median());
    return result;
}

void measure(Report& report, const Load& load, uint32_t width, uint32_t height, const char* size, bool is_cpu) {
    std::vector<std::string> names;
    std::vector<double> times;
    std::vector<Image> pictures;
    std::vector<std::string> parts;
    const auto take = [&](std::span<const std::unique_ptr<Form>> sides, uint32_t rounds) {
        std::ranges::copy(timesOf(sides, is_cpu, rounds), std::back_inserter(times));
        for (const auto& side : sides) {
            pictures.push_back(side->picture());
            parts.push_back(side->parts());
        }
    };
    if (Device driver = createPipelineDevice()) {
        std::vector<std::unique_ptr<Form>> sides;
        const Scene scene(driver, !load.is_coherent);
        sides.push_back(std::make_unique<OneKernel>(driver, scene, load, width, height, OneKernel::Stages));
        names.emplace_back("driver's pipeline");
        take(sides, is_cpu ? 1 : gpu_rounds);
    }
    Device device = createDevice(TracingEngine::Software);
    const Scene scene(device, !load.is_coherent);
    std::vector<std::unique_ptr<Form>> sides;
    const size_t joined = names.size();
    sides.push_back(std::make_unique<OneKernel>(device, scene, load, width, height, OneKernel::Stages));
    names.emplace_back("joined stages");
    sides.push_back(std::make_unique<OneKernel>(device, scene, load, width, height, OneKernel::Queries));
    names.emplace_back("kernel of queries");
    for (const bool is_sorted : {false, true}) {
        sides.push_back(std::make_unique<Wavefront>(device, scene, load, width, height, is_sorted));
        names.emplace_back(forms[is_sorted ? 1 : 0]);
    }
    // 06's rays do not end one earlier than the other.
    if (!load.is_coherent) {
        sides.push_back(std::make_unique<OneKernel>(device, scene, load, width, height, OneKernel::Refilled));
        names.emplace_back(forms[2]);
    }
    take(sides, is_cpu ? cpu_rounds : gpu_rounds);

    fmt::print("  {} at {} x {}: milliseconds{}, speed over the joined stages', pixels that differ from theirs by more "
               "than 2 and 16 of 255\n",
               load.name, width, height, is_cpu ? " of all processors" : "");
    const size_t pixels = size_t{width} * height;
    for (size_t i = 0; i < names.size(); i++) {
        const size_t few = differences(pictures[i], pictures[joined], 2);
        fmt::print("    {:<18} {:9.2f}  {:6.3f}  {:6} {:6}  {}\n", names[i], times[i] * 1e3, times[joined] / times[i],
                   few, differences(pictures[i], pictures[joined], 16), parts[i]);
        // Rays at edges, which rounding sends elsewhere, and all that follows from them.
        if (few * 50 > pixels) throw std::runtime_error(fmt::format("the pictures of '{}' do not agree", names[i]));
    }
    std::fflush(stdout);
    // To be looked at.
    check(pictures[joined].save(report.folder() / fmt::format("traversal_{}{}.png", load.name, size)));
    for (size_t i = joined + 2; i < names.size(); i++)
        report.add(figureOf(load, names[i].c_str(), size), times[joined] / times[i], "ratio of speeds",
                   fmt::format("stages joined into one kernel, {} x {}", width, height), deviceName(device));
}

void run(Report& report) {
    const bool is_cpu = createDevice().getInfo().cpu;
    const std::string& filter = report.options().filter;
    for (const Load& load : loads) {
        const auto wants = [&](const char* size) {
            return std::ranges::any_of(
                forms, [&](const char* form) { return figureOf(load, form, size).find(filter) != std::string::npos; });
        };
        if (wants(""))
            measure(report, load, is_cpu ? load.cpu_width : 1600, is_cpu ? load.cpu_height : 900, "", is_cpu);
        if (!is_cpu && wants(".4k")) measure(report, load, 3840, 2160, ".4k", is_cpu);
    }
}

}  // namespace

Benchmark traversalWavefrontBenchmark() {
    Benchmark benchmark = {{}, run};
    for (const Load& load : loads)
        for (const char* size : {"", ".4k"})
            for (const char* form : forms)
                if (!load.is_coherent || form != forms[2]) benchmark.figures.push_back(figureOf(load, form, size));
    return benchmark;
}

}  // namespace glint::bench
