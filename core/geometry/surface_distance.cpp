#include <glint/geometry/surface_distance.h>

#include <glint/geometry/detail/triangle_tree.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

namespace glint {

namespace {

using detail::nearestPoint;
using detail::TriangleTree;

/// A convex, flat piece of a triangle.
struct Piece {
    static constexpr uint32_t most = 12;
    std::array<Vector3d, most> corners;
    uint32_t count = 0;
    uint32_t guess = 0;  ///< a triangle of the other surface that may be near
    double upper = std::numeric_limits<double>::infinity();

    void add(const Vector3d& corner) { corners[count++] = corner; }
    Vector3d center() const {
        Vector3d sum(0.0);
        for (uint32_t i = 0; i < count; i++) sum += corners[i];
        return sum / static_cast<double>(count);
    }
};

/// Cuts a piece by the plane through `point`: `inside` gets what lies in direction `inward`. A cut adds a corner.
/// Corners within `width` of the plane lie on it, or a piece would be cut for ever where it has been cut before.
void cut(const Piece& piece, const Vector3d& point, const Vector3d& inward, double width, Piece& inside,
         Piece& outside) {
    std::array<double, Piece::most> side;
    const double length = glm::length(inward);
    for (uint32_t i = 0; i < piece.count; i++) {
        side[i] = length > 0.0 ? glm::dot(piece.corners[i] - point, inward) / length : 0.0;
        if (std::abs(side[i]) <= width) side[i] = 0.0;
    }
    inside.count = outside.count = 0;
    for (uint32_t i = 0; i < piece.count; i++) {
        const uint32_t next = i + 1 < piece.count ? i + 1 : 0;
        if (side[i] >= 0.0) inside.add(piece.corners[i]);
        if (side[i] <= 0.0) outside.add(piece.corners[i]);
        if ((side[i] > 0.0 && side[next] < 0.0) || (side[i] < 0.0 && side[next] > 0.0)) {
            const Vector3d crossing = glm::mix(piece.corners[i], piece.corners[next], side[i] / (side[i] - side[next]));
            inside.add(crossing);
            outside.add(crossing);
        }
    }
    inside.guess = outside.guess = piece.guess;
    inside.upper = outside.upper = piece.upper;
}

/// Measures from the triangles of one surface to another surface.
class OneSided {
public:
    OneSided(const TriangleTree& from, const TriangleTree& to, double tolerance, double floor, SurfaceDistance& result)
        : from_(from), to_(to), tolerance_(1.0 + tolerance), floor_(floor), result_(result) {}

    void measure() {
        // Corners first: they are usually the farthest, and what is known to be far lets the rest be passed over.
        std::vector<uint32_t> vertices(from_.indices().begin(), from_.indices().begin() + size_t{3} * from_.size());
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        if (from_.positions().data() == to_.positions().data()) {
            // A simplified mesh has vertices of the original one: the search for these is over where it begins.
            at_vertex_.reserve(size_t{3} * to_.size());
            for (uint32_t i = 0; i < 3 * to_.size(); i++) at_vertex_.emplace_back(to_.indices()[i], i / 3);
            std::sort(at_vertex_.begin(), at_vertex_.end());
        }
        std::vector<uint32_t> nearest(vertices.size(), UINT32_MAX), guesses(from_.size());
        std::vector<double> uppers(from_.size());
        uint32_t guess = 0;
        for (uint32_t i = 0; i < from_.size(); i++) {
            const auto corners = from_.triangle(i);
            uppers[i] = std::numeric_limits<double>::infinity();
            uint32_t last = UINT32_MAX;
            for (size_t k = 0; k < 3; k++) {
                const uint32_t vertex = from_.indices()[i * size_t{3} + k];
                uint32_t& found_before = nearest[static_cast<size_t>(
                    std::lower_bound(vertices.begin(), vertices.end(), vertex) - vertices.begin())];
                if (found_before == UINT32_MAX) found_before = found(corners[k], guessFor(vertex, guess));
                guess = found_before;
                if (guess != last) uppers[i] = std::min(uppers[i], farthest(corners.data(), 3, guess).second);
                last = guess;
            }
            guesses[i] = guess;
        }
        budget_ = (1u << 16) + uint64_t{16} * (uint64_t{from_.size()} + to_.size());
        for (uint32_t i = 0; i < from_.size(); i++) {
            if (isSettled(uppers[i])) continue;
            Piece piece;
            for (const Vector3d& corner : from_.triangle(i)) piece.add(corner);
            piece.guess = guesses[i];
            piece.upper = uppers[i];
            pieces_.push_back(piece);
            while (!pieces_.empty()) {
                const Piece next = pieces_.back();
                pieces_.pop_back();
                split(next);
            }
        }
    }

private:
    /// Takes a bound into account that is good enough; false if it is not.
    bool isSettled(double upper) {
        if (upper > std::max(result_.lower * tolerance_, floor_) && budget_ > 0) return false;
        result_.upper = std::max(result_.upper, upper);
        return true;
    }

    /// A triangle to begin the search for a vertex with.
    uint32_t guessFor(uint32_t vertex, uint32_t otherwise) const {
        const auto place = std::lower_bound(at_vertex_.begin(), at_vertex_.end(), std::pair(vertex, 0u));
        return place != at_vertex_.end() && place->first == vertex ? place->second : otherwise;
    }

    /// Takes the distance of a point into account and returns the triangle nearest to it.
    uint32_t found(const Vector3d& point, uint32_t guess) {
        const TriangleTree::Nearest nearest = to_.nearest(point, guess);
        result_.lower = std::max(result_.lower, std::sqrt(nearest.distance2));
        return nearest.triangle;
    }

    /// The corner that is farthest from a triangle, and its distance: no point of the polygon is farther.
    std::pair<uint32_t, double> farthest(const Vector3d* corners, uint32_t count, uint32_t triangle) const {
        const auto other = to_.triangle(triangle);
        std::pair<uint32_t, double> worst = {0, 0.0};
        for (uint32_t i = 0; i < count; i++) {
            const double distance = glm::length(nearestPoint(other, corners[i]) - corners[i]);
            if (distance >= worst.second) worst = {i, distance};
        }
        return worst;
    }

    void push(Piece& piece, double upper, uint32_t guess) {
        piece.upper = std::min(piece.upper, upper);
        piece.guess = guess;
        if (!isSettled(piece.upper)) pieces_.push_back(piece);
    }

    void split(const Piece& piece) {
        if (isSettled(piece.upper)) return;
        budget_--;
        const uint32_t nearest = found(piece.center(), piece.guess);
        const auto [corner, upper] = farthest(piece.corners.data(), piece.count, nearest);
        if (isSettled(std::min(upper, piece.upper))) return;
        const uint32_t at_corner = found(piece.corners[corner], nearest);
        const double by_corner = farthest(piece.corners.data(), piece.count, at_corner).second;
        const double bound = std::min({upper, by_corner, piece.upper});
        if (isSettled(bound)) return;
        if (piece.count + 3 > Piece::most || !cutAlong(piece, nearest, bound)) halve(piece, nearest, bound);
    }

    /// Cuts along the prism over a triangle. False if the piece lies wholly inside or wholly outside of each side.
    bool cutAlong(const Piece& piece, uint32_t triangle, double bound) {
        const auto other = to_.triangle(triangle);
        const Vector3d normal = glm::cross(other[1] - other[0], other[2] - other[0]);
        Piece rest = piece, inside, outside;
        bool has_cut = false;
        for (int k = 0; k < 3 && rest.count > 2; k++) {
            cut(rest, other[k], glm::cross(normal, other[(k + 1) % 3] - other[k]), floor_ * 0x1p-10, inside, outside);
            if (outside.count < 3 || inside.count < 3) continue;
            has_cut = true;
            push(outside, bound, triangle);
            rest = inside;
        }
        if (has_cut) push(rest, farthest(rest.corners.data(), rest.count, triangle).second, triangle);
        return has_cut;
    }

    /// Cuts across the longest way between corners; what is cut off from one corner has few.
    void halve(const Piece& piece, uint32_t guess, double bound) {
        if (piece.count > 5) {
            Piece part;
            for (uint32_t i = 0; i <= piece.count / 2; i++) part.add(piece.corners[i]);
            push(part, bound, guess);
            part.count = 0;
            for (uint32_t i = piece.count / 2; i <= piece.count; i++) part.add(piece.corners[i % piece.count]);
            push(part, bound, guess);
            return;
        }
        Vector3d from = piece.corners[0], to = from;
        for (uint32_t i = 0; i < piece.count; i++)
            for (uint32_t j = 0; j < i; j++)
                if (glm::distance(piece.corners[i], piece.corners[j]) > glm::distance(from, to)) {
                    from = piece.corners[i];
                    to = piece.corners[j];
                }
        Piece inside, outside;
        cut(piece, (from + to) * 0.5, to - from, 0.0, inside, outside);
        for (Piece* part : {&inside, &outside})
            if (part->count > 0) push(*part, farthest(part->corners.data(), part->count, guess).second, guess);
    }

    const TriangleTree& from_;
    const TriangleTree& to_;
    const double tolerance_;
    const double floor_;
    SurfaceDistance& result_;
    std::vector<std::pair<uint32_t, uint32_t>> at_vertex_;  ///< vertex and triangle of the other surface
    std::vector<Piece> pieces_;
    uint64_t budget_ = 1;
};

}  // namespace

SurfaceDistance hausdorffDistance(std::span<const Vector3f> positions_a, std::span<const uint32_t> indices_a,
                                  std::span<const Vector3f> positions_b, std::span<const uint32_t> indices_b,
                                  double tolerance) {
    const bool has_a = indices_a.size() >= 3, has_b = indices_b.size() >= 3;
    if (!has_a && !has_b) return {};
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!has_a || !has_b) return {infinity, infinity};

    const TriangleTree a(positions_a, indices_a), b(positions_b, indices_b);
    Vector3d low(infinity), high(-infinity);
    for (const TriangleTree* tree : {&a, &b})
        for (uint32_t i = 0; i < tree->size(); i++)
            for (const Vector3d& corner : tree->triangle(i)) {
                low = glm::min(low, corner);
                high = glm::max(high, corner);
            }
    const double floor = glm::length(high - low) * 0x1p-20;
    SurfaceDistance result;
    OneSided(a, b, tolerance, floor, result).measure();
    OneSided(b, a, tolerance, floor, result).measure();
    const Vector3d largest = glm::max(glm::abs(low), glm::abs(high));
    result.upper += std::max({largest.x, largest.y, largest.z}) * 0x1p-40;
    return result;
}

SurfaceDistance hausdorffDistance(const Mesh& a, const Mesh& b, double tolerance) {
    return hausdorffDistance(a.positions, a.indices, b.positions, b.indices, tolerance);
}

}  // namespace glint
