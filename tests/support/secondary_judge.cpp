#include "support/secondary_judge.h"

#include <glint/math/ray.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace glint::test {

namespace {

constexpr double unit = 0x1p-24;

Vector3d transformed(const Matrix4x4d& matrix, const Vector3d& p) { return Vector3d(matrix * Vector4d(p, 1.0)); }
Vector3d turned(const Matrix4x4d& matrix, const Vector3d& v) { return Vector3d(matrix * Vector4d(v, 0.0)); }
double largest(const Vector3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Distance from a point to the segment between two others.
double pointToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
    const Vector3d along = b - a;
    const double square = glm::dot(along, along);
    const double place = square > 0.0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0.0;
    return glm::length(p - (a + along * place));
}

/// Distance between two segments: of their lines, where the nearest points lie in both, else from one of the four ends.
double segmentToSegment(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    double distance =
        std::min({pointToSegment(a, c, d), pointToSegment(b, c, d), pointToSegment(c, a, b), pointToSegment(d, a, b)});
    const Vector3d first = b - a;
    const Vector3d second = d - c;
    const Vector3d across = glm::cross(first, second);
    const double square = glm::dot(across, across);
    if (square > 0.0) {
        const double s = glm::dot(glm::cross(c - a, second), across) / square;
        const double t = glm::dot(glm::cross(c - a, first), across) / square;
        if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0)
            distance = std::min(distance, std::abs(glm::dot(c - a, across)) / std::sqrt(square));
    }
    return distance;
}

/// A triangle, and a segment from `from` to `to`.
struct Meeting {
    double border = 0.0;    ///< distance between the segment and the border
    double distance = 0.0;  ///< between the segment and the triangle
    double from = 0.0;      ///< heights of the ends over the triangle's plane
    double to = 0.0;
    bool crosses = false;

    Meeting(const std::array<Vector3d, 3>& corners, const Vector3d& begin, const Vector3d& end) {
        const Vector3d normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
        from = glm::dot(begin - corners[0], normal);
        to = glm::dot(end - corners[0], normal);
        border = 1e300;
        for (size_t i = 0; i < 3; i++)
            border = std::min(border, segmentToSegment(begin, end, corners[i], corners[(i + 1) % 3]));
        const auto isOver = [&](const Vector3d& p) {
            for (size_t i = 0; i < 3; i++) {
                const Vector3d edge = corners[(i + 1) % 3] - corners[i];
                if (glm::dot(glm::cross(edge, p - corners[i]), normal) < 0.0) return false;
            }
            return true;
        };
        crosses = from * to < 0.0 && isOver(begin + (end - begin) * (from / (from - to)));
        distance = border;
        if (isOver(begin)) distance = std::min(distance, std::abs(from));
        if (isOver(end)) distance = std::min(distance, std::abs(to));
        if (crosses) distance = 0.0;
    }
};

std::array<Vector3d, 3> cornersOf(const Mesh& mesh, uint32_t triangle) {
    const uint32_t* indices = &mesh.indices[size_t{3} * triangle];
    return {Vector3d(mesh.positions[indices[0]]), Vector3d(mesh.positions[indices[1]]),
            Vector3d(mesh.positions[indices[2]])};
}

bool isSamePrimary(const SecondaryResult& a, const SecondaryResult& b) {
    return a.first == b.first && a.instance == b.instance && a.barycentrics == b.barycentrics &&
           a.position == b.position && a.offset == b.offset && a.mirrored == b.mirrored && a.to_object == b.to_object;
}

}  // namespace

void SecondaryJudge::check(uint32_t triangle, uint32_t instance) const {
    if (triangle >= scene_.mesh.triangleCount() || instance >= scene_.transforms.size())
        throw std::runtime_error(fmt::format("there is no triangle {} of instance {}", triangle, instance));
}

SecondaryCount& SecondaryCount::operator+=(const SecondaryCount& other) {
    rays += other.rays;
    acne += other.acne;
    strays += other.strays;
    sure += other.sure;
    leaks += other.leaks;
    blocked += other.blocked;
    lost += other.lost;
    if (first.empty()) first = other.first;
    return *this;
}

SecondaryJudge::SecondaryJudge(const SecondaryCase& scene, std::span<const SecondarySample> samples,
                               std::span<const SecondaryResult> results)
    : scene_(scene), reference_(scene.mesh), primary_(results.begin(), results.end()) {
    for (const Transform3x4& transform : scene.transforms) {
        Place place;
        place.translation = {transform.rows[3], transform.rows[7], transform.rows[11]};
        const auto instance = static_cast<uint32_t>(places_.size());
        const auto seen = std::find_if(results.begin(), results.end(), [&](const SecondaryResult& result) {
            return result.first != SecondaryResult::none && result.instance == instance;
        });
        if (seen == results.end()) throw std::runtime_error(fmt::format("no primary ray meets instance {}", instance));
        place.to_object = Matrix4x4d(seen->to_object.matrix());
        place.to_world = glm::inverse(place.to_object);
        places_.push_back(place);
    }
    shadows_.resize(samples.size());
    mirrors_.resize(samples.size());
    for (size_t i = 0; i < samples.size(); i++) {
        const SecondaryResult& result = results[i];
        if (result.first == SecondaryResult::none) continue;
        check(result.first, result.instance);
        const Vector3f to_lamp = samples[i].lamp - result.position;
        if (result.shadow != SecondaryResult::not_traced) shadows_[i] = pathOf(result, to_lamp, &samples[i].lamp);
        mirrors_[i] = pathOf(result, result.mirrored, nullptr);
    }
}

SecondaryJudge::Path SecondaryJudge::pathOf(const SecondaryResult& result, const Vector3f& direction,
                                            const Vector3f* lamp) const {
    Path path;
    path.own.instance = result.instance;
    path.own.triangle = result.first;
    const auto [a, b, c] = cornersOf(scene_.mesh, result.first);
    const Vector3d place = a + (b - a) * double(result.barycentrics.x) + (c - a) * double(result.barycentrics.y);
    path.from = transformed(places_[result.instance].to_world, place);
    path.to = lamp ? Vector3d(*lamp) : path.from + Vector3d(direction) * double(scene_.reach);
    const SurfacePoint point = {result.position, result.normal, result.offset, result.slope};
    path.start = Vector3d(spawnPoint(point, direction));
    path.slope = result.slope;
    const double rise = glm::dot(Vector3d(result.normal), Vector3d(direction));
    path.side = rise < 0.0 ? -1.0 : 1.0;
    // A segment ends at its lamp, however high it starts.
    path.climb = (std::abs(rise) - (lamp ? double(result.offset) : 0.0)) / largest(Vector3d(direction));

    for (uint32_t instance = 0; instance < places_.size(); instance++) {
        const Vector3d from = transformed(places_[instance].to_object, path.from);
        const Vector3d end = transformed(places_[instance].to_object, path.to);
        Surface surface;
        surface.instance = instance;
        const auto consider = [&](Surface& best, const ReferenceHierarchy::Filter& filter) {
            const ReferenceHit hit = reference_.closestHit(from, end - from, 0.0, best.exists() ? best.t : 1.0, filter);
            if (!hit.hit) return;
            best = {instance, hit.triangle, hit.t, 0.0};
            best.tolerance = tolerance(path, best);
        };
        const auto isOther = [&](const ReferenceHit& hit) {
            return instance != path.own.instance || hit.triangle != path.own.triangle;
        };
        consider(path.exact, isOther);
        consider(path.sure, [&](const ReferenceHit& hit) {
            if (!isOther(hit)) return false;
            surface.triangle = hit.triangle;
            const double clear = margin(path, surface);
            const Meeting meeting(cornersOf(scene_.mesh, hit.triangle), from, end);
            return meeting.crosses && meeting.border > clear && std::abs(meeting.from) > clear &&
                   std::abs(meeting.to) > clear;
        });
    }
    return path;
}

double SecondaryJudge::margin(const Path& path, const Surface& surface) const {
    const Place& place = places_[surface.instance];
    const Vector3d start = transformed(place.to_object, path.start);
    double reach = 0.0;
    for (const Vector3d& corner : cornersOf(scene_.mesh, surface.triangle))
        reach = std::max(reach, glm::length(corner - start));
    const Vector3d rounded =
        4.0 * glm::abs(path.start) + 6.0 * glm::abs(place.translation) + 20.0 * glm::abs(path.to - path.from);
    Vector3d sizes(0.0);
    for (int i = 0; i < 3; i++) sizes += glm::abs(Vector3d(place.to_object[i])) * rounded[i];
    return glm::length(turned(place.to_object, path.start - path.from)) + unit * (glm::length(sizes) + 16.0 * reach);
}

// The margin across the triangle's plane, along the ray.
double SecondaryJudge::tolerance(const Path& path, const Surface& surface) const {
    const auto [a, b, c] = cornersOf(scene_.mesh, surface.triangle);
    const Vector3d normal = glm::normalize(glm::cross(b - a, c - a));
    const double across = glm::dot(normal, turned(places_[surface.instance].to_object, path.to - path.from));
    return margin(path, surface) / std::max(std::abs(across), 1e-300);
}

// What docs/rays.md promises under "Its own triangle", "Its neighbours" and "At any distance"; of segments, if the lamp
// is higher over the plane than the offset.
bool SecondaryJudge::isPromised(const Path& path, const Surface& surface) const {
    if (surface.instance != path.own.instance || path.climb < 0.0) return false;
    if (surface.triangle == path.own.triangle) return true;
    const auto own = cornersOf(scene_.mesh, path.own.triangle);
    const auto other = cornersOf(scene_.mesh, surface.triangle);
    const Vector3d normal = glm::normalize(glm::cross(own[1] - own[0], own[2] - own[0])) * path.side;
    const Vector3d place = transformed(places_[path.own.instance].to_object, path.from);
    const double size = std::max({largest(own[1] - own[0]), largest(own[2] - own[1]), largest(own[0] - own[2])});
    bool is_near = true;
    for (const Vector3d& corner : other) {
        const double rounding = 4.0 * unit * glm::dot(glm::abs(normal), glm::max(glm::abs(corner), glm::abs(own[0])));
        if (glm::dot(corner - own[0], normal) > rounding) return false;
        is_near = is_near && largest(corner - place) <= 2.0 * size;
    }
    return is_near || path.climb > path.slope;
}

SecondaryJudge::Counts SecondaryJudge::count(std::span<const SecondaryResult> results) const {
    Counts counts;
    for (size_t i = 0; i < results.size(); i++) {
        const SecondaryResult& result = results[i];
        if (!isSamePrimary(result, primary_[i]))
            throw std::runtime_error(fmt::format("primary ray {} has another hit", i));
        if (result.first == SecondaryResult::none) continue;
        Surface met;
        const auto meet = [&](uint32_t triangle, uint32_t instance, float t) {
            met = {};
            if (triangle == SecondaryResult::none) return;
            check(triangle, instance);
            met = {instance, triangle, double(t) / scene_.reach, 0.0};
        };
        if (result.shadow != SecondaryResult::not_traced) {
            meet(result.shadow, result.shadow_instance, 0.0f);
            judge(shadows_[i], met, true, counts.shadow, i);
        }
        meet(result.mirror, result.mirror_instance, result.mirror_t);
        judge(mirrors_[i], met, false, counts.mirror, i);
    }
    return counts;
}

void SecondaryJudge::judge(const Path& path, Surface met, bool any, SecondaryCount& count, size_t ray) const {
    count.rays++;
    count.blocked += path.exact.exists() ? 1 : 0;
    count.sure += path.sure.exists() ? 1 : 0;
    const auto complain = [&](const char* what, const Surface& surface) {
        if (count.first.empty())
            count.first = fmt::format("ray {} from triangle {} of instance {}: {} triangle {} of instance {}", ray,
                                      path.own.triangle, path.own.instance, what, surface.triangle, surface.instance);
    };
    if (met.exists()) {
        const Matrix4x4d& to_object = places_[met.instance].to_object;
        const Meeting meeting(cornersOf(scene_.mesh, met.triangle), transformed(to_object, path.from),
                              transformed(to_object, path.to));
        if (isPromised(path, met)) {
            count.acne++;
            complain("it meets", met);
        } else if (meeting.distance > margin(path, met)) {
            count.strays++;
            complain("it strays to", met);
        }
        met.tolerance = tolerance(path, met);
    }
    // Shadow rays stop at whatever they meet.
    const auto isPassed = [&](const Surface& surface) {
        if (!surface.exists()) return false;
        if (!met.exists()) return true;
        const bool is_same = met.instance == surface.instance && met.triangle == surface.triangle;
        return !any && !is_same && met.t > surface.t + surface.tolerance + met.tolerance;
    };
    count.lost += isPassed(path.exact) ? 1 : 0;
    if (isPassed(path.sure)) {
        count.leaks++;
        complain("it passes", path.sure);
    }
}

}  // namespace glint::test
