#include <glint/geometry/refine.h>

#include <glint/base/format_error.h>
#include <glint/geometry/detail/subdivision.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace glint {

namespace detail {

namespace {

constexpr double pi_d = 3.14159265358979323846;

/// The faces and edges around a vertex, counter-clockwise. Face i lies between the edges i and i + 1; a closed ring has
/// as many edges as faces and may begin anywhere, an open one has one more and begins and ends at the boundary.
class Ring {
public:
    void walk(const Topology& topology, uint32_t start) {
        topology_ = &topology;
        halves_.clear();
        uint32_t half = start;
        do {
            halves_.push_back(half);
            half = topology.twin(topology.previous(half));
        } while (half != none && half != start);
        closed_ = half == start;
        sharp_.clear();
        for (uint32_t i = 0; i < edgeCount(); i++)
            if (topology.sharpness[topology.edges[out(i)]] > 0.0f) sharp_.push_back(i);
    }

    /// Makes a closed ring begin at its first sharp edge.
    void turn() {
        if (!closed_ || sharp_.empty() || sharp_.front() == 0) return;
        const uint32_t first = sharp_.front();
        std::rotate(halves_.begin(), halves_.begin() + first, halves_.end());
        for (uint32_t& edge : sharp_) edge -= first;
    }

    uint32_t faceCount() const { return static_cast<uint32_t>(halves_.size()); }
    uint32_t edgeCount() const { return faceCount() + (closed_ ? 0 : 1); }
    bool isClosed() const { return closed_; }
    /// The sharp edges.
    const std::vector<uint32_t>& sharp() const { return sharp_; }
    bool isCorner() const { return sharp_.size() > 2 || (!closed_ && faceCount() == 1); }
    /// The vertex' corner in face i.
    uint32_t corner(uint32_t face) const { return halves_[face]; }
    uint32_t face(uint32_t face) const { return topology_->faces[halves_[face]]; }
    /// A corner at the other end of edge i.
    uint32_t neighbour(uint32_t edge) const {
        return edge < faceCount() ? topology_->next(halves_[edge]) : topology_->previous(halves_.back());
    }

private:
    /// A half-edge of edge i.
    uint32_t out(uint32_t edge) const {
        return edge < faceCount() ? halves_[edge] : topology_->previous(halves_.back());
    }

    const Topology* topology_ = nullptr;
    std::vector<uint32_t> halves_;
    std::vector<uint32_t> sharp_;
    bool closed_ = true;
};

/// Weights of the points around a vertex: itself, the ends of its edges and, in Catmull-Clark's scheme, the opposite
/// corners of its quadrilaterals.
struct Mask {
    double self = 0.0;
    std::vector<double> edges, faces;
};

/// The limit of a vertex without creases or with one (a dart), and two tangents, the second counter-clockwise of the
/// first. Without tangents where these vanish.
struct SmoothMasks {
    Mask position, along, across;
};

/// The eigenvector of a scheme's ring with sharp edge 0 alone has no closed form: rows are multiplied by the matrix of
/// one step until they stay.
class DartIteration {
public:
    DartIteration(Subdivision scheme, uint32_t n) : scheme_(scheme), n_(n) {}

    /// The weights of the points before a step that give what `mask` gives after it.
    Mask before(const Mask& mask) const {
        Mask old{.self = 0.0, .edges = std::vector<double>(n_, 0.0), .faces = {}};
        if (scheme_ == Subdivision::Loop) {
            const double beta = loopWeight(n_);
            old.self = mask.self * (1.0 - n_ * beta);
            for (uint32_t i = 0; i < n_; i++) {
                const bool sharp = i == 0;
                const double edge = mask.edges[i];
                old.self += edge * (sharp ? 0.5 : 0.375);
                old.edges[i] += mask.self * beta + edge * (sharp ? 0.5 : 0.375);
                if (sharp) continue;
                old.edges[i - 1] += edge * 0.125;
                old.edges[(i + 1) % n_] += edge * 0.125;
            }
            return old;
        }
        const double n = n_;
        old.faces.assign(n_, 0.0);
        old.self = mask.self * (n - 2.0) / n;
        for (uint32_t i = 0; i < n_; i++) {
            const double weight = mask.edges[i] * (i == 0 ? 0.5 : 0.25);
            old.self += weight;
            old.edges[i] += weight + mask.self / (n * n);
        }
        for (uint32_t i = 0; i < n_; i++) {
            const uint32_t next = (i + 1) % n_;
            const double edges = (i == 0 ? 0.0 : mask.edges[i]) + (next == 0 ? 0.0 : mask.edges[next]);
            const double centroid = mask.faces[i] + mask.self / (n * n) + edges * 0.25;
            old.self += centroid * 0.25;
            old.edges[i] += centroid * 0.25;
            old.edges[next] += centroid * 0.25;
            old.faces[i] += centroid * 0.25;
        }
        return old;
    }

    /// Makes it the eigenvector of the largest eigenvalue among masks that are symmetric about the sharp edge. Masks
    /// whose weights sum up to 0 stay so. Slow to converge at vertices of a hundred edges and more, but there the
    /// smooth mask that it begins with is close.
    void converge(Mask& mask, double sum) const {
        for (int step = 0; step < 4096; step++) {
            Mask old = before(mask);
            for (uint32_t i = 1; 2 * i < n_; i++) balance(old.edges[i], old.edges[n_ - i]);
            for (uint32_t i = 0; 2 * i + 1 < old.faces.size(); i++) balance(old.faces[i], old.faces[n_ - 1 - i]);
            double total = old.self, size = std::abs(old.self);
            for (const auto* weights : {&old.edges, &old.faces})
                for (const double weight : *weights) {
                    total += weight;
                    size += std::abs(weight);
                }
            if (sum == 0.0) old.self -= total;
            const double scale = sum == 0.0 ? 1.0 / size : sum / total;
            old.self *= scale;
            double change = std::abs(old.self - mask.self);
            for (const auto& [now, then] : {std::pair(&old.edges, &mask.edges), std::pair(&old.faces, &mask.faces)})
                for (size_t i = 0; i < now->size(); i++) {
                    (*now)[i] *= scale;
                    change += std::abs((*now)[i] - (*then)[i]);
                }
            mask = std::move(old);
            if (change < 1e-15) return;
        }
    }

private:
    static void balance(double& a, double& b) { a = b = (a + b) * 0.5; }

    Subdivision scheme_;
    uint32_t n_;
};

/// Halstead et al. 1993, Loop 1987.
SmoothMasks smoothMasks(Subdivision scheme, uint32_t edge_count, bool is_dart) {
    const double n = edge_count;
    const double angle = 2.0 * pi_d / n;
    SmoothMasks masks;
    double edge_weight = 1.0;  // in tangents
    if (scheme == Subdivision::CatmullClark) {
        const double sum = n * (n + 5.0);
        masks.position = {n * n / sum, std::vector<double>(edge_count, 4.0 / sum),
                          std::vector<double>(edge_count, 1.0 / sum)};
        const double c = std::cos(angle);
        edge_weight = 1.0 + c + std::cos(angle / 2.0) * std::sqrt(2.0 * (9.0 + c));
    } else {
        const double weight = 1.0 / (n + 3.0 / (8.0 * loopWeight(edge_count)));
        masks.position = {1.0 - n * weight, std::vector<double>(edge_count, weight), {}};
    }
    if (is_dart) DartIteration(scheme, edge_count).converge(masks.position, 1.0);
    if (edge_count == 2) return masks;
    for (uint32_t i = 0; i < edge_count; i++) {
        masks.along.edges.push_back(edge_weight * std::cos(angle * i));
        masks.across.edges.push_back(edge_weight * std::sin(angle * i));
        if (scheme == Subdivision::Loop) continue;
        masks.along.faces.push_back(std::cos(angle * i) + std::cos(angle * (i + 1)));
        masks.across.faces.push_back(std::sin(angle * i) + std::sin(angle * (i + 1)));
    }
    // What is odd about the sharp edge has no weight there: its mask is that of a smooth vertex.
    if (is_dart) DartIteration(scheme, edge_count).converge(masks.along, 0.0);
    return masks;
}

/// The tangent that leads from a crease into a sector of smooth faces. With the crease at 0, a sector of m faces is
/// half of a smooth ring of 2m whose other half is its negative, so inside weights are sines; those of the crease, w at
/// both of its edges and s at the vertex, follow from the eigenvalue l: l w = w / 2 + s / 8 + edges and l s = w + 3 s /
/// 4 + self, with what the points inside give to an edge's end and to the vertex. More than one face.
Mask sectorMask(Subdivision scheme, uint32_t face_count) {
    const double angle = pi_d / face_count;
    const double c = std::cos(angle);
    Mask mask{.self = 0.0, .edges = std::vector<double>(face_count + 1, 0.0), .faces = {}};
    double value = 0.0, edges = 0.0, self = 0.0;
    if (scheme == Subdivision::CatmullClark) {
        const double edge_weight = 1.0 + c + std::cos(angle / 2.0) * std::sqrt(2.0 * (9.0 + c));
        value = (4.0 + edge_weight) / 16.0;
        for (uint32_t i = 0; i < face_count; i++) {
            if (i > 0) mask.edges[i] = edge_weight * std::sin(angle * i);
            mask.faces.push_back(std::sin(angle * i) + std::sin(angle * (i + 1)));
            self += mask.edges[i] * 0.375 + mask.faces[i] * 0.25;
        }
        edges = mask.faces[0] * 0.25 + mask.edges[1] * 0.0625;
    } else {
        value = 0.375 + c * 0.25;
        for (uint32_t i = 1; i < face_count; i++) {
            mask.edges[i] = std::sin(angle * i);
            self += mask.edges[i] * 0.375;
        }
        edges = mask.edges[1] * 0.125;
    }
    const double determinant = (value - 1.0) * (value - 0.25);
    mask.edges.front() = mask.edges.back() = ((value - 0.75) * edges + self * 0.125) / determinant;
    mask.self = ((value - 0.5) * self + edges) / determinant;
    return mask;
}

/// Moves the vertices of a surface to their limits.
class LimitPass {
public:
    LimitPass(const Surface& surface, Subdivision scheme) : surface_(surface), scheme_(scheme) {}

    void run() {
        const Topology& topology = surface_.topology;
        limits_.reserve(surface_.channels.size());
        for (const Channel& channel : surface_.channels) limits_.push_back(channel.values);
        normals_.components = 3;
        normals_.indices.assign(topology.cornerCount(), none);

        std::vector<uint32_t> starts(topology.vertex_count, none);
        for (uint32_t half = 0; half < topology.cornerCount(); half++) {
            uint32_t& start = starts[topology.vertices[half]];
            if (start == none || topology.twin(half) == none) start = half;
        }
        for (const uint32_t start : starts) {
            if (start == none) continue;
            ring_.walk(topology, start);
            ring_.turn();
            for (size_t i = surface_.channels.size(); i-- > 0;) setLimit(i);
            setNormals();
        }
    }

    std::vector<std::vector<double>>& limits() { return limits_; }
    Channel& normals() { return normals_; }

private:
    const double* value(const Channel& channel, uint32_t corner) const {
        const auto& indices = channel.indices.empty() ? surface_.topology.vertices : channel.indices;
        return &channel.values[size_t{indices[corner]} * channel.components];
    }

    double* edgePoint(uint32_t edge) { return &points_[size_t{1 + edge} * components_]; }
    double* facePoint(uint32_t face) { return &points_[size_t{1 + ring_.edgeCount() + face} * components_]; }

    /// The points that masks weigh. Catmull-Clark's are those of one step further, where all faces are quadrilaterals:
    /// their corners opposite the vertex are the centroids of the faces here.
    void gather(const Channel& channel) {
        const uint32_t c = components_ = channel.components;
        const uint32_t edges = ring_.edgeCount(), faces = ring_.faceCount();
        points_.assign(size_t{1 + edges + faces} * c, 0.0);
        const double* here = value(channel, ring_.corner(0));
        if (scheme_ == Subdivision::Loop) {
            addTo(points_.data(), here, 1.0, c);
            for (uint32_t i = 0; i < edges; i++) addTo(edgePoint(i), value(channel, ring_.neighbour(i)), 1.0, c);
            return;
        }
        const Topology& topology = surface_.topology;
        for (uint32_t i = 0; i < faces; i++) {
            const uint32_t first = topology.offsets[ring_.face(i)], end = topology.offsets[ring_.face(i) + 1];
            for (uint32_t corner = first; corner < end; corner++)
                addTo(facePoint(i), value(channel, corner), 1.0 / (end - first), c);
        }
        const std::vector<uint32_t>& sharp = ring_.sharp();
        const bool is_smooth = sharp.size() < 2;
        const double ring_weight = 1.0 / (static_cast<double>(edges) * edges);
        size_t next_sharp = 0;
        for (uint32_t i = 0; i < edges; i++) {
            const bool is_sharp = next_sharp < sharp.size() && sharp[next_sharp] == i;
            next_sharp += is_sharp;
            const double* there = value(channel, ring_.neighbour(i));
            addTo(edgePoint(i), here, is_sharp ? 0.5 : 0.25, c);
            addTo(edgePoint(i), there, is_sharp ? 0.5 : 0.25, c);
            if (!is_sharp) {
                addTo(edgePoint(i), facePoint(i), 0.25, c);
                addTo(edgePoint(i), facePoint(i == 0 ? faces - 1 : i - 1), 0.25, c);
            }
            if (is_smooth) {
                addTo(points_.data(), there, ring_weight, c);
                addTo(points_.data(), facePoint(i), ring_weight, c);
            } else if (is_sharp && sharp.size() == 2 && !ring_.isCorner()) {
                addTo(points_.data(), there, 0.125, c);
            }
        }
        const double self = is_smooth ? (edges - 2.0) / edges : ring_.isCorner() ? 1.0 : 0.75;
        addTo(points_.data(), here, self, c);
    }

    /// A mask over the edges from `first` on.
    void apply(const Mask& mask, uint32_t first, double* sum) {
        const uint32_t c = components_;
        addTo(sum, points_.data(), mask.self, c);
        for (uint32_t i = 0; i < mask.edges.size(); i++)
            addTo(sum, edgePoint((first + i) % ring_.edgeCount()), mask.edges[i], c);
        for (uint32_t i = 0; i < mask.faces.size(); i++) addTo(sum, facePoint(first + i), mask.faces[i], c);
    }
    Vector3d apply(const Mask& mask, uint32_t first) {
        std::array<double, 3> sum{};
        apply(mask, first, sum.data());
        return {sum[0], sum[1], sum[2]};
    }

    const SmoothMasks& smooth() {
        const std::pair<uint32_t, bool> key = {ring_.edgeCount(), ring_.sharp().size() == 1};
        const auto found = smooth_.find(key);
        return found != smooth_.end() ? found->second
                                      : smooth_.emplace(key, smoothMasks(scheme_, key.first, key.second)).first->second;
    }
    const Mask& sector(uint32_t faces) {
        const auto found = sectors_.find(faces);
        return found != sectors_.end() ? found->second
                                       : sectors_.emplace(faces, sectorMask(scheme_, faces)).first->second;
    }

    bool isOnSeam(const Channel& channel) const {
        if (channel.indices.empty()) return false;
        const Topology& topology = surface_.topology;
        for (uint32_t i = 0; i < ring_.faceCount(); i++) {
            const uint32_t half = ring_.corner(i), twin = topology.twin(half);
            if (twin != none && (channel.indices[half] != channel.indices[topology.next(twin)] ||
                                 channel.indices[topology.next(half)] != channel.indices[twin]))
                return true;
        }
        return false;
    }

    void setLimit(size_t index) {
        const Channel& channel = surface_.channels[index];
        const bool stays = ring_.isCorner() || isOnSeam(channel);
        if (stays && index > 0) return;  // of positions, which come last, the points are wanted for normals
        gather(channel);
        if (stays) return;
        const auto& indices = channel.indices.empty() ? surface_.topology.vertices : channel.indices;
        double* limit = &limits_[index][size_t{indices[ring_.corner(0)]} * channel.components];
        std::fill(limit, limit + channel.components, 0.0);
        if (ring_.sharp().size() < 2) return apply(smooth().position, 0, limit);
        // The point at parameter 0 of a uniform cubic B-spline, from its control points of any step.
        addTo(limit, points_.data(), 4.0 / 6.0, channel.components);
        for (const uint32_t edge : ring_.sharp()) addTo(limit, edgePoint(edge), 1.0 / 6.0, channel.components);
    }

    // Normals, with the points of the positions.

    Vector3d point(const double* p) const { return {p[0], p[1], p[2]}; }
    Vector3d position(uint32_t corner) const { return point(value(surface_.channels.front(), corner)); }

    /// The mean of the normals of some of the ring's faces, weighted by area.
    Vector3d faceNormal(uint32_t first, uint32_t count) const {
        const Topology& topology = surface_.topology;
        Vector3d sum(0.0);
        for (uint32_t i = first; i < first + count; i++) {
            const uint32_t begin = topology.offsets[ring_.face(i)], end = topology.offsets[ring_.face(i) + 1];
            const Vector3d origin = position(begin);
            for (uint32_t corner = begin + 2; corner < end; corner++)
                sum += glm::cross(position(corner - 1) - origin, position(corner) - origin);
        }
        return sum;
    }

    /// The normal of a plane of two tangents if their lengths and their angle can be told from rounding, else zero.
    Vector3d planeNormal(const Vector3d& a, const Vector3d& b, double least_sine) const {
        const Vector3d normal = glm::cross(a, b);
        const double length_a = glm::length(a), length_b = glm::length(b);
        if (std::min(length_a, length_b) <= rounding() || glm::length(normal) <= least_sine * length_a * length_b)
            return Vector3d(0.0);
        return normal / (length_a * length_b);
    }

    /// More than what the steps before have made of coinciding points.
    double rounding() const { return 1e-13 * glm::length(point(points_.data())); }

    Vector3d smoothNormal() {
        const SmoothMasks& masks = smooth();
        if (masks.along.edges.empty()) return Vector3d(0.0);
        return planeNormal(apply(masks.along, 0), apply(masks.across, 0), 1e-12);
    }

    Vector3d sectorNormal(uint32_t first, uint32_t count) {
        const uint32_t last = (first + count) % ring_.edgeCount();
        const bool is_corner = ring_.isCorner();
        // On a crease with one face, what is left after the tangent along it is its curvature: the plane is the same.
        if (is_corner || count == 1) {
            const Vector3d here = position(ring_.corner(0));
            // Positions come in float32: an angle of less than 1e-5 may be its rounding.
            const Vector3d normal =
                planeNormal(position(ring_.neighbour(first)) - here, position(ring_.neighbour(last)) - here, 1e-5);
            return glm::dot(normal, faceNormal(first, count)) < 0.0 ? -normal : normal;
        }
        return planeNormal(point(edgePoint(first)) - point(edgePoint(last)), apply(sector(count), first), 1e-12);
    }

    void addNormal(Vector3d normal, uint32_t first, uint32_t count) {
        double length = glm::length(normal);
        if (length == 0.0) {
            normal = faceNormal(first, count);
            length = glm::length(normal);
            if (length <= rounding() * rounding()) length = 0.0;
        }
        normal = length > 0.0 ? normal / length : Vector3d(0, 0, 1);
        const auto number = static_cast<uint32_t>(normals_.count());
        normals_.values.insert(normals_.values.end(), {normal.x, normal.y, normal.z});
        for (uint32_t i = first; i < first + count; i++) normals_.indices[ring_.corner(i)] = number;
    }

    void setNormals() {
        const std::vector<uint32_t>& sharp = ring_.sharp();
        if (sharp.size() < 2) return addNormal(smoothNormal(), 0, ring_.faceCount());
        // The ring begins at a sharp edge.
        for (size_t i = 0; i < sharp.size(); i++) {
            const uint32_t first = sharp[i];
            const uint32_t end = i + 1 < sharp.size() ? sharp[i + 1] : ring_.faceCount();
            if (first < end) addNormal(sectorNormal(first, end - first), first, end - first);
        }
    }

    const Surface& surface_;
    const Subdivision scheme_;
    std::vector<std::vector<double>> limits_;
    Channel normals_;
    Ring ring_;
    uint32_t components_ = 0;
    std::vector<double> points_;
    std::map<std::pair<uint32_t, bool>, SmoothMasks> smooth_;
    std::map<uint32_t, Mask> sectors_;
};

}  // namespace

}  // namespace detail

Expected<PolygonMesh> toLimit(const PolygonMesh& cage, Subdivision scheme, uint32_t steps, uint64_t limit) {
    Expected<detail::Surface> surface = detail::refineSurface(cage, scheme, steps, limit);
    if (!surface) return unexpected(surface.error());
    const detail::Topology& topology = surface->topology;
    for (uint32_t edge = 0; edge < topology.edgeCount(); edge++)
        if (const float sharpness = topology.sharpness[edge]; sharpness > 0.0f && std::isfinite(sharpness)) {
            const uint32_t half = topology.halves[edge][0];
            return unexpected(
                makeError(ErrorCode::InvalidArgument, "refine.crease_left",
                          "after {} steps the edge from vertex {} to vertex {} has the sharpness {} still: "
                          "limits are known for 0 and infinity",
                          steps, topology.vertices[half], topology.vertices[topology.next(half)], sharpness));
        }
    detail::LimitPass pass(*surface, scheme);
    pass.run();
    for (size_t i = 0; i < surface->channels.size(); i++) surface->channels[i].values = std::move(pass.limits()[i]);
    PolygonMesh mesh = detail::toPolygonMesh(std::move(*surface), cage);
    const detail::Channel& normals = pass.normals();
    mesh.attributes.push_back({.name = "normal",
                               .components = 3,
                               .values = {normals.values.begin(), normals.values.end()},
                               .indices = std::move(pass.normals().indices)});
    return mesh;
}

}  // namespace glint
