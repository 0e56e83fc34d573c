// tracing.tradeoff.*: what the software engine's choices trade: bits of a node's planes and the widening of its boxes
// against time and leaks, the offset of spawn points against rays that meet what they leave and surfaces that are
// jumped over. `./dev report` makes the tables and charts of docs/accuracy.md from what is written.

#include "bench/tracing_batch.h"
#include "bench/tracing_scenes.h"
#include "support/hierarchies.h"
#include "support/reference.h"
#include "support/seam_rays.h"
#include "support/spawn_tracer.h"

#include <glint/base/file.h>
#include <glint/base/thread_pool.h>
#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/primitives.h>

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace glint::bench {

namespace {

using detail::BuildMode;
using detail::Hierarchy;

Buffer upload(Device device, const Hierarchy& hierarchy) {
    return device.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
}

/// Best times of several batches that take turns, in processor time, which does not depend on what else runs. The first
/// turn, when kernels are compiled, does not count.
std::vector<double> bestTimes(std::span<RayBatch> batches, uint32_t rays, uint32_t turns) {
    std::vector<Times> times(batches.size());
    for (uint32_t turn = 0; turn <= turns; turn++) {
        for (size_t i = 0; i < batches.size(); i++) {
            const double begin = processSeconds();
            batches[i].trace(rays);
            if (turn != 0) times[i].values.push_back(processSeconds() - begin);
        }
    }
    std::vector<double> best;
    for (const Times& each : times) best.push_back(each.minimum());
    return best;
}

// ------------------------------------------------------------------------------------------------------- widening

void compareWidenings(Report& report, const TracingScene& scene) {
    constexpr uint32_t leak_rays = 1u << 19;
    const Device device = createDevice();
    // 2^-19 is in the middle; 0 stands for -infinity.
    const std::vector<int> exponents = {0, -26, -25, -24, -23, -22, -21, -20, -19, -18, -17, -16, -14, -12};
    std::vector<Kernel> kernels;
    for (const int exponent : exponents)
        kernels.push_back(
            createRayKernel(device, batch_kernel,
                            fmt::format("GLINT_TRACING_WIDENING={:.9e}", exponent == 0 ? 0.0 : std::exp2(exponent))));

    const Hierarchy hierarchy = test::hierarchyOf(scene.mesh, BuildMode::Quality, &ThreadPool::shared());
    const Buffer buffer = upload(device, hierarchy);
    std::vector<double> seconds[2];
    for (const bool bounce : {false, true}) {
        const auto& rays = bounce ? scene.bounce : scene.camera;
        std::vector<RayBatch> batches;
        for (const Kernel& kernel : kernels) batches.emplace_back(device, kernel, buffer, rays);
        seconds[bounce] = bestTimes(batches, static_cast<uint32_t>(rays.size()), 5);
    }

    std::vector<uint64_t> leaks(exponents.size());
    const std::vector<test::ClosedMesh> meshes = test::closedMeshes();
    for (const test::ClosedMesh& mesh : meshes) {
        const Buffer closed = upload(device, test::hierarchyOf(mesh.mesh));
        const std::vector<Ray> rays = test::raysAtSeams(mesh, leak_rays, 77);
        for (size_t i = 0; i < exponents.size(); i++) {
            RayBatch batch(device, kernels[i], closed, rays);
            batch.trace(leak_rays);
            const std::vector<RayHit> hits = batch.hits();
            // Quicker than with bounds, which every hit of the test of leaks is held to.
            leaks[i] += static_cast<uint64_t>(std::count_if(
                hits.begin(), hits.end(), [](const RayHit& hit) { return !hit.isHit() || hit.t > 1.01f; }));
        }
    }

    const uint64_t all = uint64_t{leak_rays} * meshes.size();
    std::string table =
        fmt::format("{}; {}, 1,048,576 rays of each kind; {} rays at seams.\n\n", deviceName(device), scene.name, all) +
        "| widening, of the reach | leaks | time, camera | time, bounce |\n|---|---|---|---|\n";
    std::string curve = "# log2 of the widening, leaks of a million, time of camera and bounce rays over no widening\n";
    size_t derived = 0;
    for (size_t i = 0; i < exponents.size(); i++) {
        const double camera = seconds[0][i] / seconds[0][0];
        const double bounce = seconds[1][i] / seconds[1][0];
        if (exponents[i] == -19) derived = i;
        table += fmt::format("| {} | {} | {:.3f} | {:.3f} |\n",
                             exponents[i] == 0     ? "0"
                             : exponents[i] == -19 ? "**2^-19**"
                                                   : fmt::format("2^{}", exponents[i]),
                             leaks[i], camera, bounce);
        curve += fmt::format("{} {} {} {}\n", exponents[i] == 0 ? -28 : exponents[i],
                             1e6 * static_cast<double>(leaks[i]) / static_cast<double>(all), camera, bounce);
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "widening.md", table));
    check(writeTextFile(report.folder() / "widening.dat", curve));
    report.add("tracing.tradeoff.widening.leaks", static_cast<double>(leaks[derived]), fmt::format("of {} rays", all),
               "closed meshes", deviceName(device));
    report.add("tracing.tradeoff.widening.leaks_without", static_cast<double>(leaks[0]), fmt::format("of {} rays", all),
               "closed meshes", deviceName(device));
    report.add("tracing.tradeoff.widening.time", seconds[0][derived] / seconds[0][0], "ratio", "no widening",
               deviceName(device));
}

// --------------------------------------------------------------------------------------------------- quantisation

struct Box {
    Vector3d lo = Vector3d(std::numeric_limits<double>::infinity());
    Vector3d hi = Vector3d(-std::numeric_limits<double>::infinity());

    void add(const Box& other) {
        lo = glm::min(lo, other.lo);
        hi = glm::max(hi, other.hi);
    }
    double halfArea() const {
        const Vector3d size = hi - lo;
        return size.x * size.y + size.y * size.z + size.z * size.x;
    }
};

/// A hierarchy with the exact boxes of all children.
struct ExactTree {
    const Hierarchy& hierarchy;
    std::vector<detail::Node> nodes;        ///< the root is 1
    std::vector<std::array<Box, 8>> boxes;  ///< of each node's children

    explicit ExactTree(const Hierarchy& source) : hierarchy(source), nodes(source.nodes + 1), boxes(source.nodes + 1) {
        std::memcpy(static_cast<void*>(nodes.data()), source.texels.data(), nodes.size() * sizeof(detail::Node));
        fill(1);
    }

    std::array<Vector3d, 3> corners(uint32_t record) const {
        detail::Record values;
        std::memcpy(&values, &hierarchy.texels[hierarchy.firstRecord() + size_t{3} * record], sizeof(values));
        std::array<Vector3d, 3> result;
        for (size_t i = 0; i < 3; i++)
            result[i] = Vector3d(values.values[3 * i], values.values[3 * i + 1], values.values[3 * i + 2]);
        return result;
    }

private:
    Box fill(uint32_t node) {
        Box all;
        for (uint32_t s = 0; s < nodes[node].children(); s++) {
            Box& box = boxes[node][s];
            if (s < nodes[node].leaves()) {
                for (const Vector3d& corner : corners(nodes[node].record() + s)) box.add({corner, corner});
            } else {
                box = fill(nodes[node].child(s));
            }
            all.add(box);
        }
        return all;
    }
};

/// Boxes with planes of `bits` bits on a grid of each node, as the encoder makes it: its unit is the least power of two
/// for which 2^bits - 2 of them hold all children.
std::vector<std::array<Box, 8>> quantised(const ExactTree& tree, int bits) {
    std::vector<std::array<Box, 8>> result = tree.boxes;
    for (size_t node = 1; node < result.size(); node++) {
        Box all;
        const uint32_t children = tree.nodes[node].children();
        for (uint32_t s = 0; s < children; s++) all.add(result[node][s]);
        for (int axis = 0; axis < 3 && children != 0; axis++) {
            const double extent = all.hi[axis] - all.lo[axis];
            if (extent <= 0.0) continue;
            const double unit = std::exp2(std::ceil(std::log2(extent / (std::exp2(bits) - 2.0))));
            const double base = std::floor(all.lo[axis] / unit) * unit;
            for (uint32_t s = 0; s < children; s++) {
                Box& box = result[node][s];
                box.lo[axis] = base + std::floor((box.lo[axis] - base) / unit) * unit;
                box.hi[axis] = base + std::ceil((box.hi[axis] - base) / unit) * unit;
            }
        }
    }
    return result;
}

struct Visits {
    uint64_t nodes = 0;
    uint64_t triangles = 0;
};

bool hitsTriangle(const std::array<Vector3d, 3>& corners, const Vector3d& origin, const Vector3d& direction,
                  double& t) {
    const Vector3d ab = corners[1] - corners[0];
    const Vector3d ac = corners[2] - corners[0];
    const Vector3d across = glm::cross(direction, ac);
    const double determinant = glm::dot(ab, across);
    const Vector3d from = origin - corners[0];
    const double u = glm::dot(from, across) / determinant;
    const Vector3d other = glm::cross(from, ab);
    const double v = glm::dot(direction, other) / determinant;
    const double distance = glm::dot(ac, other) / determinant;
    if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && distance < t)) return false;
    t = distance;
    return true;
}

/// The traversal of shaders/tracing in float64: nearest children first, all that are not beyond the closest hit.
void visit(const ExactTree& tree, const std::vector<std::array<Box, 8>>& boxes, uint32_t node, const Ray& ray,
           double& t, Visits& visits) {
    visits.nodes++;
    const Vector3d origin(ray.origin);
    const Vector3d inverse = 1.0 / Vector3d(ray.direction);
    std::array<std::pair<double, uint32_t>, 8> order;
    uint32_t count = 0;
    for (uint32_t s = 0; s < tree.nodes[node].children(); s++) {
        const Vector3d a = (boxes[node][s].lo - origin) * inverse;
        const Vector3d b = (boxes[node][s].hi - origin) * inverse;
        const Vector3d near = glm::min(a, b);
        const Vector3d far = glm::max(a, b);
        const double first = std::max({near.x, near.y, near.z, 0.0});
        if (first > std::min({far.x, far.y, far.z, t})) continue;
        uint32_t place = count++;
        for (; place > 0 && order[place - 1].first > first; place--) order[place] = order[place - 1];
        order[place] = {first, s};
    }
    for (uint32_t i = 0; i < count; i++) {
        // As the traversal: what was entered on the list is visited, also where something nearer has been met since.
        const uint32_t s = order[i].second;
        if (s < tree.nodes[node].leaves()) {
            visits.triangles++;
            hitsTriangle(tree.corners(tree.nodes[node].record() + s), origin, Vector3d(ray.direction), t);
        } else {
            visit(tree, boxes, tree.nodes[node].child(s), ray, t, visits);
        }
    }
}

/// The hierarchy with nodes whose boxes are these, as far as 8 bits can tell.
Hierarchy encoded(const ExactTree& tree, const std::vector<std::array<Box, 8>>& boxes) {
    Hierarchy result;
    result.texels = detail::Array<detail::Texel>(tree.hierarchy.texels.size());
    std::copy(tree.hierarchy.texels.begin(), tree.hierarchy.texels.end(), result.texels.begin());
    // One larger than that of the exact boxes, as a grid has to hold what goes over.
    detail::Header header = readHeader(tree.hierarchy);
    detail::Box4 bounds;
    std::vector<std::array<detail::Box4, 8>> floats(boxes.size());
    for (size_t node = 1; node < boxes.size(); node++) {
        for (uint32_t s = 0; s < tree.nodes[node].children(); s++) {
            float lo[4] = {};
            float hi[4] = {};
            for (int axis = 0; axis < 3; axis++) {
                lo[axis] = std::nextafter(static_cast<float>(boxes[node][s].lo[axis]), -1e30f);
                hi[axis] = std::nextafter(static_cast<float>(boxes[node][s].hi[axis]), 1e30f);
            }
            floats[node][s].lo = detail::Float4::load(lo);
            floats[node][s].hi = detail::Float4::load(hi);
            bounds.add(floats[node][s]);
        }
    }
    const detail::Grid grid = detail::makeGrid(bounds);
    std::memcpy(header.minimum, grid.minimum, sizeof(header.minimum));
    header.step = grid.step;
    header.scale_bits = std::bit_cast<uint32_t>(grid.step) - (uint32_t{detail::exponent_bias} << 23);
    std::memcpy(result.texels.data(), &header, sizeof(header));
    for (size_t node = 1; node < boxes.size(); node++) {
        const detail::Node& old = tree.nodes[node];
        const auto fresh = detail::Node::encode(grid, floats[node].data(), old.children(), old.leaves(),
                                                (old.words[2] >> 8) + old.leaves(), old.record());
        std::memcpy(&result.texels[4 * node], &fresh, sizeof(fresh));
    }
    return result;
}

void compareQuantisation(Report& report, const TracingScene& scene) {
    constexpr size_t stride = 61;
    const Device device = createDevice();
    const Kernel kernel = createRayKernel(device, batch_kernel, "");
    const Hierarchy hierarchy = test::hierarchyOf(scene.mesh, BuildMode::Quality, &ThreadPool::shared());
    const ExactTree tree(hierarchy);
    struct Row {
        int bits;  ///< 24: floats
        double looseness = 0.0;
        Visits visits[2];
        double seconds[2] = {};
    };
    std::vector<Row> rows;
    std::vector<Buffer> buffers;
    double exact_area = 0.0;
    for (const int bits : {24, 4, 5, 6, 7, 8}) {
        Row row = {bits};
        const auto boxes = bits == 24 ? tree.boxes : quantised(tree, bits);
        double area = 0.0;
        for (size_t node = 1; node < boxes.size(); node++)
            for (uint32_t s = 0; s < tree.nodes[node].children(); s++) area += boxes[node][s].halfArea();
        if (bits == 24) exact_area = area;
        row.looseness = area / exact_area;
        size_t count = 0;
        for (const bool bounce : {false, true}) {
            const auto& rays = bounce ? scene.bounce : scene.camera;
            for (size_t i = 0; i < rays.size(); i += stride) {
                double t = rays[i].t_max;
                visit(tree, boxes, 1, rays[i], t, row.visits[bounce]);
                count++;
            }
        }
        rows.push_back(row);
        if (bits < 24)
            buffers.push_back(upload(device, bits == 8
                                                 ? std::move(*check(detail::buildHierarchy(
                                                       std::array{test::geometryOf(scene.mesh)}, BuildMode::Quality)))
                                                 : encoded(tree, boxes)));
    }
    for (const bool bounce : {false, true}) {
        const auto& rays = bounce ? scene.bounce : scene.camera;
        std::vector<RayBatch> batches;
        for (const Buffer& buffer : buffers) batches.emplace_back(device, kernel, buffer, rays);
        const std::vector<double> seconds = bestTimes(batches, static_cast<uint32_t>(rays.size()), 5);
        for (size_t i = 0; i < seconds.size(); i++) rows[i + 1].seconds[bounce] = seconds[i];
        // All have the same hits: boxes decide what is tried, never what is found.
        const std::vector<RayHit> hits = batches.back().hits();
        for (RayBatch& batch : batches)
            if (batch.hits() != hits) throw std::runtime_error("hits depend on the boxes");
    }
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());

    std::string table =
        fmt::format("{}; {}, visits in float64 for every {}st ray.\n\n", deviceName(device), scene.name, stride) +
        "| bits a plane | bytes a node | area of boxes | nodes, camera | triangles, camera | time, camera | nodes, "
        "bounce | triangles, bounce | time, bounce |\n|---|---|---|---|---|---|---|---|---|\n";
    std::string curve =
        "# bits, bytes, area, nodes (camera, bounce), triangles (camera, bounce), time (camera, bounce)\n";
    const Row& exact = rows.back();
    const Row& eight = rows[rows.size() - 2];
    for (const Row& row : rows) {
        const int bytes = row.bits == 24 ? 16 + 48 * 4 : 16 + 6 * row.bits;
        const auto ratio = [](uint64_t a, uint64_t b) { return static_cast<double>(a) / static_cast<double>(b); };
        double nodes[2];
        double triangles[2];
        std::string times[2];
        for (int i = 0; i < 2; i++) {
            nodes[i] = ratio(row.visits[i].nodes, exact.visits[i].nodes);
            triangles[i] = ratio(row.visits[i].triangles, exact.visits[i].triangles);
            times[i] = row.bits == 24 ? "" : fmt::format("{:.3f}", row.seconds[i] / eight.seconds[i]);
        }
        table += fmt::format("| {} | {} | {:.3f} | {:.3f} | {:.3f} | {} | {:.3f} | {:.3f} | {} |\n",
                             row.bits == 24 ? "floats" : std::to_string(row.bits), bytes, row.looseness, nodes[0],
                             triangles[0], times[0], nodes[1], triangles[1], times[1]);
        curve += fmt::format("{} {} {} {} {} {} {} {} {}\n", row.bits == 24 ? 9 : row.bits, bytes, row.looseness,
                             nodes[0], nodes[1], triangles[0], triangles[1], times[0].empty() ? "NaN" : times[0],
                             times[1].empty() ? "NaN" : times[1]);
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "quantisation.md", table));
    check(writeTextFile(report.folder() / "quantisation.dat", curve));
    report.add("tracing.tradeoff.quantisation.nodes",
               static_cast<double>(eight.visits[0].nodes) / static_cast<double>(exact.visits[0].nodes), "ratio",
               "nodes visited with float boxes, camera rays", "any");
    report.add("tracing.tradeoff.quantisation.time_4_bits", rows[0].seconds[0] / eight.seconds[0], "ratio",
               "8 bits a plane, camera rays", deviceName(device));
}

// ---------------------------------------------------------------------------------------------------- spawn offset

/// Pairs of equal triangles across Z, the upper one 1 to 1024 units of the last place higher, their logarithms evenly
/// distributed. Triangle 2i is the lower one of pair i, 2i + 1 the upper.
test::SpawnCase gaps() {
    constexpr int cells = 64;
    test::Random random(41);
    test::SpawnCase result = {"gaps", {}, {Transform3x4()}};
    Mesh& mesh = result.mesh;
    for (int cell = 0; cell < cells * cells; cell++) {
        const Vector2d center(cell % cells - cells / 2, cell / cells - cells / 2);
        const auto z = static_cast<float>(random.uniform(2.0, 3.9));
        const double angle = random.uniform(0.0, 6.0);
        const auto gap = static_cast<float>(std::round(std::exp2(random.uniform(0.0, 10.0)))) * 0x1p-22f;
        for (const float height : {z, z + gap}) {
            for (int i = 0; i < 3; i++) {
                const double a = angle + i * 2.0943951;
                mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
                mesh.positions.push_back(Vector3f(static_cast<float>((center.x + 0.45 * std::cos(a)) * 0.1),
                                                  static_cast<float>((center.y + 0.45 * std::sin(a)) * 0.1), height));
            }
        }
    }
    return result;
}

void compareOffsets(Report& report) {
    constexpr uint32_t rays = 200000;
    const Device device = createDevice();
    test::SpawnTracer tracer(device, false);
    const std::vector<float> multiples = {0.0f, 0.015625f, 0.03125f, 0.0625f, 0.125f, 0.1875f, 0.25f, 0.375f,
                                          0.5f, 0.75f,     1.0f,     2.0f,    4.0f,   8.0f,    16.0f};
    std::vector<test::SpawnCase> cases = test::spawnCases();
    const std::string list[] = {"identity", "turned", "stretched", "moved 1e7"};
    struct Row {
        std::vector<double> shares;  ///< of the named cases
        double all = 0.0;
        double jumped = 0.0;
    };
    std::vector<Row> rows(multiples.size());
    std::vector<uint64_t> own(multiples.size());
    uint64_t tried = 0;
    float least = 0.0f;  // with no ray that meets what it leaves
    for (const test::SpawnCase& scene : cases) {
        const std::vector<test::SpawnSample> samples = test::spawnSamples(scene, rays, 50);
        for (size_t i = 0; i < multiples.size(); i++) {
            uint64_t left = 0;
            uint64_t met = 0;
            for (const test::SpawnResult& result :
                 tracer.trace(scene, samples, test::SpawnMode::Corners, multiples[i])) {
                left += result.first != test::SpawnResult::none ? 1 : 0;
                met += result.meetsItsOwn() ? 1 : 0;
            }
            own[i] += met;
            if (i == 0) tried += left;
            if (std::find(std::begin(list), std::end(list), scene.name) != std::end(list))
                rows[i].shares.push_back(static_cast<double>(met) / static_cast<double>(left));
        }
    }
    // From below: hit the lower triangle and go on through it.
    const test::SpawnCase pairs = gaps();
    std::vector<test::SpawnSample> samples = test::spawnSamples(pairs, rays, 51);
    test::Random random(52);
    for (test::SpawnSample& sample : samples) {
        const Vector3d target = Vector3d(sample.origin) + Vector3d(sample.direction);
        const Vector3d below = Vector3d(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), -0.5);
        sample.origin = Vector3f(target + below);
        sample.direction = Vector3f(target - Vector3d(sample.origin));
        sample.elevation = static_cast<float>(random.uniform(0.5, 1.0));
    }
    for (size_t i = 0; i < multiples.size(); i++) {
        uint64_t through = 0;
        uint64_t jumped = 0;
        for (const test::SpawnResult& result : tracer.trace(pairs, samples, test::SpawnMode::Corners, multiples[i])) {
            if (result.first == test::SpawnResult::none || result.first % 2 != 0) continue;
            through++;
            jumped += result.second != result.first + 1 && result.second != result.first ? 1 : 0;
        }
        rows[i].jumped = static_cast<double>(jumped) / static_cast<double>(through);
        rows[i].all = static_cast<double>(own[i]) / static_cast<double>(tried);
    }
    for (size_t i = multiples.size(); i-- > 0 && own[i] == 0;) least = multiples[i];

    std::string table = fmt::format("{}; {} rays from hits in {} cases.\n\n", deviceName(device), tried, cases.size());
    table += "| offset, of the bound | rays that meet what they leave | share";
    for (const std::string& name : list) table += ", " + name;
    table += " | gaps jumped over |\n|---|---|---|---|\n";
    std::string curve = "# multiple, share of self-hits (all, then each), share of gaps jumped over\n";
    for (size_t i = 0; i < multiples.size(); i++) {
        std::string shares;
        curve += fmt::format("{} {}", multiples[i], rows[i].all);
        for (const double share : rows[i].shares) {
            shares += fmt::format("{}{:.1e}", shares.empty() ? "" : ", ", share);
            curve += fmt::format(" {}", share);
        }
        curve += fmt::format(" {}\n", rows[i].jumped);
        table += fmt::format("| {} | {} | {} | {:.3f} |\n", multiples[i], own[i], shares, rows[i].jumped);
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "spawn.md", table));
    check(writeTextFile(report.folder() / "spawn.dat", curve));
    const auto at_bound = static_cast<size_t>(std::find(multiples.begin(), multiples.end(), 1.0f) - multiples.begin());
    report.add("tracing.tradeoff.spawn.self_hits", static_cast<double>(own[at_bound]), fmt::format("of {} rays", tried),
               "none, by the bound", deviceName(device));
    report.add("tracing.tradeoff.spawn.least_multiple", least, "of the bound", "no self-hits", deviceName(device));
}

void run(Report& report) {
    const TracingScene scene = makeTracingScene("100k");
    compareWidenings(report, scene);
    compareQuantisation(report, scene);
    compareOffsets(report);
}

}  // namespace

Benchmark tracingTradeoffsBenchmark() {
    return {{"tracing.tradeoff.widening.leaks", "tracing.tradeoff.widening.leaks_without",
             "tracing.tradeoff.widening.time", "tracing.tradeoff.quantisation.nodes",
             "tracing.tradeoff.quantisation.time_4_bits", "tracing.tradeoff.spawn.self_hits",
             "tracing.tradeoff.spawn.least_multiple"},
            run};
}

}  // namespace glint::bench
