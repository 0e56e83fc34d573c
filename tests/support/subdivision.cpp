#include "support/subdivision.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace glint::test {

namespace {

using Edge = std::pair<uint32_t, uint32_t>;

Edge edgeOf(uint32_t a, uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

Vector3d centroid(const ReferenceSurface& surface, const std::vector<uint32_t>& face) {
    Vector3d sum(0.0);
    for (const uint32_t vertex : face) sum += surface.points[vertex];
    return sum / static_cast<double>(face.size());
}

struct Neighbourhood {
    std::map<Edge, std::vector<uint32_t>> edge_faces;
    std::vector<std::vector<uint32_t>> vertex_faces;
    std::vector<std::set<uint32_t>> neighbours;

    explicit Neighbourhood(const ReferenceSurface& surface)
        : vertex_faces(surface.points.size()), neighbours(surface.points.size()) {
        for (uint32_t f = 0; f < surface.faces.size(); f++) {
            const auto& face = surface.faces[f];
            for (size_t i = 0; i < face.size(); i++) {
                const uint32_t a = face[i], b = face[(i + 1) % face.size()];
                edge_faces[edgeOf(a, b)].push_back(f);
                vertex_faces[a].push_back(f);
                neighbours[a].insert(b);
                neighbours[b].insert(a);
            }
        }
    }
};

double sharpnessOf(const ReferenceSurface& surface, const Neighbourhood& around, const Edge& edge) {
    if (around.edge_faces.at(edge).size() == 1) return std::numeric_limits<double>::infinity();
    const auto found = surface.sharpness.find(edge);
    return found == surface.sharpness.end() ? 0.0 : found->second;
}

Vector3d smoothVertex(const ReferenceSurface& surface, const Neighbourhood& around, uint32_t vertex,
                      Subdivision scheme) {
    const Vector3d& here = surface.points[vertex];
    const double n = static_cast<double>(around.neighbours[vertex].size());
    Vector3d sum(0.0), middles(0.0), centroids(0.0);
    for (const uint32_t other : around.neighbours[vertex]) {
        sum += surface.points[other];
        middles += (here + surface.points[other]) / 2.0;
    }
    if (scheme == Subdivision::Loop) {
        const double c = 3.0 / 8.0 + std::cos(2.0 * std::acos(-1.0) / n) / 4.0;
        const double alpha = 5.0 / 8.0 - c * c;
        return (1.0 - alpha) * here + alpha * sum / n;
    }
    for (const uint32_t face : around.vertex_faces[vertex]) centroids += centroid(surface, surface.faces[face]);
    return (centroids / n + 2.0 * middles / n + (n - 3.0) * here) / n;
}

Vector3d movedVertex(const ReferenceSurface& surface, const Neighbourhood& around, uint32_t vertex,
                     Subdivision scheme) {
    const Vector3d& here = surface.points[vertex];
    if (around.vertex_faces[vertex].empty()) return here;
    if (around.vertex_faces[vertex].size() == 1 && around.neighbours[vertex].size() == 2) return here;
    const auto byRule = [&](const std::vector<uint32_t>& sharp) {
        if (sharp.size() > 2) return here;
        if (sharp.size() == 2) return 0.75 * here + 0.125 * (surface.points[sharp[0]] + surface.points[sharp[1]]);
        return smoothVertex(surface, around, vertex, scheme);
    };
    std::vector<uint32_t> sharp, still_sharp;
    double leaving = 0.0;
    for (const uint32_t other : around.neighbours[vertex]) {
        const double s = sharpnessOf(surface, around, edgeOf(vertex, other));
        if (s > 0.0) sharp.push_back(other);
        if (s > 1.0) still_sharp.push_back(other);
        if (s > 0.0 && s <= 1.0) leaving += s;
    }
    if (sharp.size() == still_sharp.size()) return byRule(sharp);
    const double weight = leaving / static_cast<double>(sharp.size() - still_sharp.size());
    return weight * byRule(sharp) + (1.0 - weight) * byRule(still_sharp);
}

Vector3d edgePoint(const ReferenceSurface& surface, const Neighbourhood& around, const Edge& edge, Subdivision scheme) {
    const Vector3d& a = surface.points[edge.first];
    const Vector3d& b = surface.points[edge.second];
    const Vector3d middle = (a + b) / 2.0;
    const double sharp = std::min(sharpnessOf(surface, around, edge), 1.0);
    if (sharp == 1.0) return middle;
    Vector3d sides(0.0);
    for (const uint32_t f : around.edge_faces.at(edge)) {
        const auto& face = surface.faces[f];
        if (scheme == Subdivision::CatmullClark) {
            sides += centroid(surface, face);
        } else {
            for (const uint32_t vertex : face)
                if (vertex != edge.first && vertex != edge.second) sides += surface.points[vertex];
        }
    }
    const Vector3d smooth = scheme == Subdivision::CatmullClark ? (a + b + sides) / 4.0 : (3.0 * (a + b) + sides) / 8.0;
    return sharp * middle + (1.0 - sharp) * smooth;
}

}  // namespace

ReferenceSurface::ReferenceSurface(const PolygonMesh& mesh) {
    for (const Vector3f& p : mesh.positions) points.emplace_back(p);
    for (size_t face = 0; face < mesh.faceCount(); face++)
        faces.emplace_back(mesh.indices.begin() + mesh.offsets[face], mesh.indices.begin() + mesh.offsets[face + 1]);
    for (const PolygonCrease& crease : mesh.creases) {
        double& s = sharpness[edgeOf(crease.first, crease.second)];
        s = std::max(s, static_cast<double>(crease.sharpness));
    }
}

ReferenceSurface subdivide(const ReferenceSurface& surface, Subdivision scheme) {
    const Neighbourhood around(surface);
    ReferenceSurface finer;
    for (uint32_t vertex = 0; vertex < surface.points.size(); vertex++)
        finer.points.push_back(movedVertex(surface, around, vertex, scheme));
    std::map<Edge, uint32_t> edge_points;
    for (const auto& [edge, faces] : around.edge_faces) {
        const auto number = static_cast<uint32_t>(finer.points.size());
        edge_points[edge] = number;
        finer.points.push_back(edgePoint(surface, around, edge, scheme));
        if (const auto found = surface.sharpness.find(edge); found != surface.sharpness.end() && found->second > 1.0)
            for (const uint32_t end : {edge.first, edge.second})
                finer.sharpness[edgeOf(end, number)] = found->second - 1.0;
    }
    for (const auto& face : surface.faces) {
        const auto middle = static_cast<uint32_t>(finer.points.size());
        if (scheme == Subdivision::CatmullClark) finer.points.push_back(centroid(surface, face));
        std::vector<uint32_t> inner;
        for (size_t i = 0; i < face.size(); i++) {
            const uint32_t before = edge_points.at(edgeOf(face[(i + face.size() - 1) % face.size()], face[i]));
            const uint32_t after = edge_points.at(edgeOf(face[i], face[(i + 1) % face.size()]));
            inner.push_back(after);
            if (scheme == Subdivision::CatmullClark)
                finer.faces.push_back({face[i], after, middle, before});
            else
                finer.faces.push_back({face[i], after, before});
        }
        if (scheme == Subdivision::Loop) finer.faces.push_back(inner);
    }
    return finer;
}

ReferenceSurface ringAround(const ReferenceSurface& surface, uint32_t vertex) {
    ReferenceSurface ring;
    std::map<uint32_t, uint32_t> numbers;
    const auto number = [&](uint32_t old) {
        const auto [entry, is_new] = numbers.try_emplace(old, static_cast<uint32_t>(ring.points.size()));
        if (is_new) ring.points.push_back(surface.points[old]);
        return entry->second;
    };
    number(vertex);
    for (const auto& face : surface.faces) {
        if (std::find(face.begin(), face.end(), vertex) == face.end()) continue;
        ring.faces.emplace_back();
        for (const uint32_t old : face) ring.faces.back().push_back(number(old));
    }
    for (const auto& [edge, sharpness] : surface.sharpness)
        if (numbers.count(edge.first) && numbers.count(edge.second))
            ring.sharpness[edgeOf(numbers[edge.first], numbers[edge.second])] = sharpness;
    return ring;
}

Vector3d limitPosition(const ReferenceSurface& surface, uint32_t vertex, Subdivision scheme) {
    ReferenceSurface ring = ringAround(surface, vertex);
    for (int step = 0; step < 100; step++) ring = ringAround(subdivide(ring, scheme), 0);
    return ring.points[0];
}

Vector3d limitNormal(const ReferenceSurface& surface, uint32_t vertex, uint32_t face, Subdivision scheme, int steps) {
    // The sector: faces around the vertex that are reached from the first over edges of no sharpness.
    const Neighbourhood around(surface);
    std::set<uint32_t> sector = {face};
    for (bool grown = true; grown;) {
        grown = false;
        for (const uint32_t other : around.neighbours[vertex]) {
            if (sharpnessOf(surface, around, edgeOf(vertex, other)) > 0.0) continue;
            const auto& faces = around.edge_faces.at(edgeOf(vertex, other));
            if (sector.count(faces[0]) == sector.count(faces[1])) continue;
            sector.insert(faces.begin(), faces.end());
            grown = true;
        }
    }
    // Rings keep the order of faces, one for one.
    std::vector<bool> counts;
    for (uint32_t f = 0; f < surface.faces.size(); f++)
        if (std::find(surface.faces[f].begin(), surface.faces[f].end(), vertex) != surface.faces[f].end())
            counts.push_back(sector.count(f) > 0);

    ReferenceSurface ring = ringAround(surface, vertex);
    for (int step = 0; step < steps; step++) {
        const Vector3d here = ring.points[0];
        double size = 0.0;
        for (Vector3d& p : ring.points) {
            p -= here;
            size = std::max(size, glm::length(p));
        }
        for (Vector3d& p : ring.points) p /= size;
        ring = ringAround(subdivide(ring, scheme), 0);
    }
    Vector3d normal(0.0);
    for (size_t f = 0; f < ring.faces.size(); f++) {
        if (!counts[f]) continue;
        const auto& corners = ring.faces[f];
        for (size_t i = 2; i < corners.size(); i++)
            normal += glm::cross(ring.points[corners[i - 1]] - ring.points[corners[0]],
                                 ring.points[corners[i]] - ring.points[corners[0]]);
    }
    return glm::normalize(normal);
}

namespace {

/// The grid's point at (i, j), going on straight outside.
Vector3d gridPoint(const std::vector<Vector3d>& grid, int columns, int i, int j) {
    const int rows = static_cast<int>(grid.size()) / columns;
    if (i < 0) return 2.0 * gridPoint(grid, columns, 0, j) - gridPoint(grid, columns, -i, j);
    if (i >= columns)
        return 2.0 * gridPoint(grid, columns, columns - 1, j) - gridPoint(grid, columns, 2 * columns - 2 - i, j);
    if (j < 0) return 2.0 * gridPoint(grid, columns, i, 0) - gridPoint(grid, columns, i, -j);
    if (j >= rows) return 2.0 * gridPoint(grid, columns, i, rows - 1) - gridPoint(grid, columns, i, 2 * rows - 2 - j);
    return grid[static_cast<size_t>(j) * columns + i];
}

/// The box spline of the given directions at x (de Boor and Hoellig's recurrence), away from the lines where it is not
/// smooth. Directions are (1, 0), (0, 1), (1, 1) with the given multiplicities.
double box(const std::array<int, 3>& counts, const Vector2d& x) {
    static const std::array<Vector2d, 3> directions = {Vector2d(1, 0), Vector2d(0, 1), Vector2d(1, 1)};
    const int total = counts[0] + counts[1] + counts[2];
    std::array<int, 2> pair{};
    int kinds = 0;
    for (int k = 0; k < 3; k++)
        if (counts[k] > 0 && kinds < 2) pair[kinds++] = k;
    if (kinds < 2) return 0.0;
    const Vector2d &a = directions[pair[0]], &b = directions[pair[1]];
    const double determinant = a.x * b.y - a.y * b.x;
    const Vector2d t((x.x * b.y - x.y * b.x) / determinant, (a.x * x.y - a.y * x.x) / determinant);
    if (total == 2) return t.x >= 0 && t.x < 1 && t.y >= 0 && t.y < 1 ? 1.0 / std::abs(determinant) : 0.0;
    // x = t.x a + t.y b: the directions beyond the pair, and further copies of the pair, have the parameter 0.
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        if (counts[k] == 0) continue;
        const double parameter = k == pair[0] ? t.x : k == pair[1] ? t.y : 0.0;
        std::array<int, 3> fewer = counts;
        fewer[k]--;
        // The parameter may be given to one copy; the other copies have 0.
        sum += parameter * box(fewer, x) + (counts[k] - parameter) * box(fewer, x - directions[k]);
    }
    return sum / (total - 2);
}

}  // namespace

SplinePoint bicubicSpline(const std::vector<Vector3d>& grid, int columns, double u, double v) {
    const auto basis = [](double t) {
        return std::array<double, 4>{(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                     (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
    };
    const auto slope = [](double t) {
        return std::array<double, 4>{-(1 - t) * (1 - t) / 2, (3 * t * t - 4 * t) / 2, (-3 * t * t + 2 * t + 1) / 2,
                                     t * t / 2};
    };
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
    const auto x = basis(u - i), y = basis(v - j), dx = slope(u - i), dy = slope(v - j);
    SplinePoint point{Vector3d(0.0), Vector3d(0.0), Vector3d(0.0)};
    for (int k = 0; k < 4; k++)
        for (int l = 0; l < 4; l++) {
            const Vector3d p = gridPoint(grid, columns, i + k - 1, j + l - 1);
            point.value += p * x[k] * y[l];
            point.du += p * dx[k] * y[l];
            point.dv += p * x[k] * dy[l];
        }
    return point;
}

SplinePoint boxSpline(const std::vector<Vector3d>& grid, int columns, double u, double v) {
    // A little off the lines between triangles; the spline has continuous second derivatives.
    const Vector2d off(1.1e-10, 0.7e-10);
    SplinePoint point{Vector3d(0.0), Vector3d(0.0), Vector3d(0.0)};
    for (int i = static_cast<int>(u) - 2; i <= static_cast<int>(u) + 3; i++)
        for (int j = static_cast<int>(v) - 2; j <= static_cast<int>(v) + 3; j++) {
            const Vector2d x = Vector2d(u - i + 2, v - j + 2) + off;
            const Vector3d p = gridPoint(grid, columns, i, j);
            point.value += p * box({2, 2, 2}, x);
            // A derivative along a direction is the difference of the splines without it.
            point.du += p * (box({1, 2, 2}, x) - box({1, 2, 2}, x - Vector2d(1, 0)));
            point.dv += p * (box({2, 1, 2}, x) - box({2, 1, 2}, x - Vector2d(0, 1)));
        }
    return point;
}

}  // namespace glint::test
