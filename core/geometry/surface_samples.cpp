#include <glint/geometry/surface_samples.h>

#include <glint/base/format_error.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

namespace glint {

namespace {

constexpr uint32_t candidates_per_sample = 4;

/// Candidates in the cells of a grid, sorted along a Z-order curve through the cells: what is near in space is near in
/// memory.
class Grid {
public:
    /// Sorts the samples. `cell` is at least 2^-20 of the box, or is made so.
    Grid(std::vector<SurfaceSample>& samples, const BoundBox& box, float cell) : samples_(samples), origin_(box.min) {
        const Vector3f size = box.size();
        cell_ = std::max(cell, std::max({size.x, size.y, size.z}) * 0x1p-20f);
        std::vector<std::pair<uint64_t, uint32_t>> order(samples.size());
        for (uint32_t i = 0; i < order.size(); i++) order[i] = {keyOf(cellOf(samples[i].position)), i};
        std::sort(order.begin(), order.end());
        std::vector<SurfaceSample> sorted;
        sorted.reserve(samples.size());
        for (const auto& [key, number] : order) sorted.push_back(samples[number]);
        samples = std::move(sorted);

        size_t cells = 0;
        for (size_t i = 0; i < order.size(); i++) cells += i == 0 || order[i].first != order[i - 1].first;
        size_t slots = 16;
        while (slots < 2 * cells) slots *= 2;
        slots_.resize(slots);
        for (uint32_t i = 0; i < order.size();) {
            uint32_t end = i;
            while (end < order.size() && order[end].first == order[i].first) end++;
            find(order[i].first) = {order[i].first, i, end};
            i = end;
        }
    }

    /// Calls visit(number, distance) for every other sample of the same side that is nearer than the size of a cell.
    template <class Visit>
    void forEachNear(uint32_t number, Visit&& visit) {
        const SurfaceSample& sample = samples_[number];
        const Vector3i cell = cellOf(sample.position);
        for (int x = -1; x <= 1; x++) {
            for (int y = -1; y <= 1; y++) {
                for (int z = -1; z <= 1; z++) {
                    const Slot& slot = find(keyOf(cell + Vector3i(x, y, z)));
                    for (uint32_t i = slot.begin; i < slot.end; i++) {
                        if (i == number) continue;
                        const float distance = glm::distance(samples_[i].position, sample.position);
                        if (distance < cell_ && glm::dot(samples_[i].normal, sample.normal) > 0.0f) visit(i, distance);
                    }
                }
            }
        }
    }

    float cell() const { return cell_; }

private:
    struct Slot {
        uint64_t key = 0;
        uint32_t begin = 0;
        uint32_t end = 0;  ///< equal to begin in a free slot
    };

    Vector3i cellOf(const Vector3f& position) const { return Vector3i((position - origin_) / cell_) + 1; }

    /// Spreads 21 bits so that two zeros follow each.
    static uint64_t spread(uint64_t value) {
        value = (value | value << 32) & 0x001f00000000ffff;
        value = (value | value << 16) & 0x001f0000ff0000ff;
        value = (value | value << 8) & 0x100f00f00f00f00f;
        value = (value | value << 4) & 0x10c30c30c30c30c3;
        return (value | value << 2) & 0x1249249249249249;
    }
    static uint64_t keyOf(const Vector3i& cell) {
        return spread(static_cast<uint32_t>(cell.x)) | spread(static_cast<uint32_t>(cell.y)) << 1 |
               spread(static_cast<uint32_t>(cell.z)) << 2;
    }

    Slot& find(uint64_t key) {
        size_t slot = key * 0x9e3779b97f4a7c15u >> 20 & (slots_.size() - 1);
        while (slots_[slot].begin != slots_[slot].end && slots_[slot].key != key)
            slot = (slot + 1) & (slots_.size() - 1);
        return slots_[slot];
    }

    std::vector<SurfaceSample>& samples_;
    Vector3f origin_;
    float cell_;
    std::vector<Slot> slots_;
};

Vector3f cornerOf(const Mesh& mesh, uint32_t triangle, uint32_t corner) {
    return mesh.positions[mesh.indices[size_t{triangle} * 3 + corner]];
}

/// Twice the area, along the normal; in float64, in which no triangle of float32 corners overflows.
Vector3d areaOf(const Mesh& mesh, uint32_t triangle) {
    const Vector3d a(cornerOf(mesh, triangle, 0));
    return glm::cross(Vector3d(cornerOf(mesh, triangle, 1)) - a, Vector3d(cornerOf(mesh, triangle, 2)) - a);
}

SurfaceSample sampleAt(const Mesh& mesh, uint32_t triangle, const Vector2f& b) {
    SurfaceSample sample;
    sample.triangle = triangle;
    sample.barycentrics = b;
    const float first = 1.0f - b.x - b.y;
    sample.position =
        first * cornerOf(mesh, triangle, 0) + b.x * cornerOf(mesh, triangle, 1) + b.y * cornerOf(mesh, triangle, 2);
    sample.normal = Vector3f(glm::normalize(areaOf(mesh, triangle)));
    if (!mesh.normals.empty()) {
        const uint32_t* corners = &mesh.indices[size_t{triangle} * 3];
        const Vector3f normal =
            first * mesh.normals[corners[0]] + b.x * mesh.normals[corners[1]] + b.y * mesh.normals[corners[2]];
        const float length = glm::length(normal);
        if (length > 1e-3f && std::isfinite(length)) sample.normal = normal / length;
    }
    return sample;
}

/// A number from 0 to 1 for each i, without a pattern (the finaliser of MurmurHash3).
double noise(uint32_t i) {
    i = (i ^ i >> 16) * 0x85ebca6bu;
    i = (i ^ i >> 13) * 0xc2b2ae35u;
    return (i ^ i >> 16) * 0x1p-32;
}

/// As many candidates for every piece of the same area, one somewhere in each (at even distances they would keep step
/// with the rows of a regular mesh); in each triangle along a sequence that fills it evenly (Roberts' R2: the multiples
/// of a generalised golden ratio).
std::vector<SurfaceSample> makeCandidates(const Mesh& mesh, double area, size_t count) {
    std::vector<SurfaceSample> candidates;
    candidates.reserve(count);
    double covered = 0.0;
    uint32_t last = 0;  // that has an area
    for (uint32_t triangle = 0; triangle < mesh.triangleCount() && candidates.size() < count; triangle++) {
        const double own = glm::length(areaOf(mesh, triangle));
        if (!(own > 0.0)) continue;
        last = triangle;
        covered += own;
        while (candidates.size() < count) {
            const auto i = static_cast<double>(candidates.size());
            if ((i + noise(static_cast<uint32_t>(candidates.size()))) * area > covered * static_cast<double>(count))
                break;
            double u = std::fmod(i * 0.75487766624669276, 1.0), v = std::fmod(i * 0.56984029099805327, 1.0);
            if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
            candidates.push_back(sampleAt(mesh, triangle, Vector2f(Vector2d(u, v))));
        }
    }
    // Rounding of the sum may leave out the very last.
    while (candidates.size() < count) candidates.push_back(sampleAt(mesh, last, Vector2f(1.0f / 3.0f)));
    return candidates;
}

/// Takes away the most crowded until `count` are left. `radius`: what the samples would have around them if they were
/// spread as evenly as can be.
void eliminate(std::vector<SurfaceSample>& samples, uint32_t count, const BoundBox& box, float radius) {
    Grid grid(samples, box, 2.0f * radius);
    // Yuksel's weights: nothing is gained by keeping two farther apart than the rest will be.
    const float share = static_cast<float>(count) / static_cast<float>(samples.size());
    const float least = radius * 0.65f * (1.0f - std::pow(share, 1.5f));
    const auto weightOf = [&](float distance) {
        const float x = std::max(0.0f, 1.0f - std::max(distance, least) / grid.cell());
        return x * x * x * x * x * x * x * x;
    };
    std::vector<float> weights(samples.size(), 0.0f);
    using Entry = std::pair<float, uint32_t>;
    std::vector<Entry> entries(samples.size());
    for (uint32_t i = 0; i < samples.size(); i++) {
        grid.forEachNear(i, [&](uint32_t, float distance) { weights[i] += weightOf(distance); });
        entries[i] = {weights[i], i};
    }
    // Weights only fall: an entry that is out of date comes too early, and is put back where it belongs.
    std::priority_queue queue(std::less<Entry>(), std::move(entries));
    constexpr float gone = -1.0f;
    for (size_t left = samples.size(); left > count;) {
        const auto [weight, number] = queue.top();
        queue.pop();
        if (weight > weights[number]) {
            queue.emplace(weights[number], number);
            continue;
        }
        weights[number] = gone;
        left--;
        grid.forEachNear(number, [&](uint32_t i, float distance) {
            if (weights[i] != gone) weights[i] = std::max(weights[i] - weightOf(distance), 0.0f);
        });
    }
    size_t kept = 0;
    for (size_t i = 0; i < samples.size(); i++)
        if (weights[i] != gone) samples[kept++] = samples[i];
    samples.resize(kept);
}

void measureSpacing(std::vector<SurfaceSample>& samples, const BoundBox& box, float radius) {
    constexpr size_t neighbours = 6;
    Grid grid(samples, box, 4.0f * radius);
    for (uint32_t i = 0; i < samples.size(); i++) {
        // Where there are fewer, the rest count as far as in an even pattern.
        std::array<float, neighbours> nearest;
        nearest.fill(2.0f * radius);
        size_t found = 0;
        grid.forEachNear(i, [&](uint32_t, float distance) {
            if (found == neighbours && distance >= nearest.back()) return;
            size_t place = std::min(found, neighbours - 1);
            for (; place > 0 && nearest[place - 1] > distance; place--) nearest[place] = nearest[place - 1];
            nearest[place] = distance;
            found = std::min(found + 1, neighbours);
        });
        samples[i].spacing = std::accumulate(nearest.begin(), nearest.end(), 0.0f) / static_cast<float>(neighbours);
    }
}

}  // namespace

Expected<std::vector<SurfaceSample>> sampleSurface(const Mesh& mesh, uint32_t count) {
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    if (count == 0 || count > max_surface_samples)
        return unexpected(makeError(ErrorCode::OutOfRange, "surface.count",
                                    "samples of a surface: {} were asked for; 1 to {} can be had", count,
                                    max_surface_samples));
    double area = 0.0;
    BoundBox box;
    for (uint32_t i = 0; i < mesh.triangleCount(); i++) {
        area += glm::length(areaOf(mesh, i));
        for (uint32_t k = 0; k < 3; k++) box.add(cornerOf(mesh, i, k));
    }
    // Half of `area` is it: each point of an even pattern has sqrt(12) radius^2 of it to itself.
    const double radius = std::sqrt(0.5 * area / (std::sqrt(12.0) * count));
    const double largest = std::numeric_limits<float>::max() / 4;
    const Vector3f size = box.size();
    if (!(radius > std::numeric_limits<float>::min()) || radius > largest || !isFinite(size))
        return unexpected(makeError(ErrorCode::InvalidArgument, "surface.area",
                                    "samples of a surface: the mesh has an area of {}", 0.5 * area));

    std::vector<SurfaceSample> samples = makeCandidates(mesh, area, size_t{count} * candidates_per_sample);
    eliminate(samples, count, box, static_cast<float>(radius));
    measureSpacing(samples, box, static_cast<float>(radius));
    return samples;
}

}  // namespace glint
