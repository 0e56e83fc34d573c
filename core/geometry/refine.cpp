#include <glint/geometry/refine.h>

#include <glint/base/format_error.h>
#include <glint/geometry/detail/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint {

namespace detail {

double loopWeight(uint32_t n) {
    const double c = 3.0 / 8.0 + std::cos(6.283185307179586476925 / n) / 4.0;
    return (5.0 / 8.0 - c * c) / n;
}

namespace {

// Vertices of the next step: those of this one, one for each edge, and in Catmull-Clark's scheme one for each face.

std::vector<VertexRule> vertexRules(const Topology& topology, Subdivision scheme) {
    struct Edges {
        uint32_t all = 0, sharp = 0, staying = 0;  // staying: sharp in the next step too
        float leaving = 0.0f;                      // sum of the sharpness of the others
    };
    std::vector<Edges> edges(topology.vertex_count);
    std::vector<uint32_t> faces(topology.vertex_count, 0);
    for (const uint32_t vertex : topology.vertices) faces[vertex]++;
    for (uint32_t edge = 0; edge < topology.edgeCount(); edge++) {
        const uint32_t half = topology.halves[edge][0];
        const float sharpness = topology.sharpness[edge];
        for (const uint32_t vertex : {topology.vertices[half], topology.vertices[topology.next(half)]}) {
            edges[vertex].all++;
            edges[vertex].sharp += sharpness > 0.0f;
            edges[vertex].staying += sharpness > 1.0f;
            if (sharpness <= 1.0f) edges[vertex].leaving += sharpness;
        }
    }

    std::vector<VertexRule> rules(topology.vertex_count);
    for (uint32_t vertex = 0; vertex < topology.vertex_count; vertex++) {
        const Edges& e = edges[vertex];
        if (faces[vertex] == 0 || (faces[vertex] == 1 && e.all == 2)) continue;
        VertexRule& rule = rules[vertex];
        rule.self = 0.0;
        rule.threshold = e.sharp > 2 ? 1.0f : 0.0f;
        const auto add = [&](uint32_t sharp, double weight) {
            if (sharp > 2) {
                rule.self += weight;
            } else if (sharp == 2) {
                rule.self += weight * 0.75;
                rule.crease += weight * 0.125;
            } else if (scheme == Subdivision::CatmullClark) {
                const double n = e.all;
                rule.self += weight * (n - 2.0) / n;
                rule.edge += weight / (n * n);
                rule.face += weight / (n * n);
            } else {
                const double beta = loopWeight(e.all);
                rule.self += weight * (1.0 - e.all * beta);
                rule.edge += weight * beta;
            }
        };
        const uint32_t leaving = e.sharp - e.staying;
        const double now = leaving > 0 ? static_cast<double>(e.leaving) / leaving : 1.0;
        add(e.sharp, now);
        if (now < 1.0) add(e.staying, 1.0 - now);
    }
    return rules;
}

/// Refines one channel over the edges and faces of a surface.
class ChannelStep {
public:
    ChannelStep(const Topology& topology, const Channel& channel, Subdivision scheme)
        : topology_(topology),
          channel_(channel),
          indices_(channel.indices.empty() ? topology.vertices : channel.indices),
          scheme_(scheme),
          first_edge_(static_cast<uint32_t>(channel.count())) {
        findSeams();
        first_face_ = first_edge_ + topology_.edgeCount() + seams_;
    }

    /// The new values, without indices.
    Channel refine(const std::vector<VertexRule>& rules) {
        const size_t faces = scheme_ == Subdivision::CatmullClark ? topology_.faceCount() : 0;
        Channel finer{.components = channel_.components, .values = {}, .indices = {}};
        finer.values.assign((first_face_ + faces) * channel_.components, 0.0);
        values_ = finer.values.data();
        if (faces > 0) setFaces();
        setEdges();
        setVertices(rules);
        return finer;
    }

    uint32_t cornerValue(uint32_t corner) const { return indices_[corner]; }
    uint32_t edgeValue(uint32_t half) const {
        const uint32_t edge = topology_.edges[half];
        if (edge_values_.empty()) return first_edge_ + edge;
        const bool is_seam = edge_values_[edge + 1] - edge_values_[edge] == 2;
        return first_edge_ + edge_values_[edge] + (is_seam ? topology_.isSecond(half) : 0);
    }
    uint32_t faceValue(uint32_t face) const { return first_face_ + face; }

private:
    const double* old(uint32_t value) const { return &channel_.values[size_t{value} * channel_.components]; }
    double* made(uint32_t value) { return values_ + size_t{value} * channel_.components; }

    void findSeams() {
        if (channel_.indices.empty()) return;
        edge_values_.assign(topology_.edgeCount() + 1, 0);
        kept_.assign(topology_.vertex_count, false);
        for (uint32_t edge = 0; edge < topology_.edgeCount(); edge++) {
            const auto [half, twin] = topology_.halves[edge];
            const bool is_seam = twin != none && (indices_[half] != indices_[topology_.next(twin)] ||
                                                  indices_[twin] != indices_[topology_.next(half)]);
            edge_values_[edge + 1] = edge_values_[edge] + 1 + is_seam;
            if (!is_seam) continue;
            seams_++;
            kept_[topology_.vertices[half]] = kept_[topology_.vertices[twin]] = true;
        }
    }

    void setFaces() {
        for (uint32_t face = 0; face < topology_.faceCount(); face++) {
            const uint32_t first = topology_.offsets[face], end = topology_.offsets[face + 1];
            double* centroid = made(faceValue(face));
            const double weight = 1.0 / (end - first);
            for (uint32_t corner = first; corner < end; corner++)
                addTo(centroid, old(indices_[corner]), weight, channel_.components);
        }
    }

    void setEdges() {
        const uint32_t n = channel_.components;
        const bool catmull_clark = scheme_ == Subdivision::CatmullClark;
        const double smooth_end = catmull_clark ? 0.25 : 0.375;
        for (uint32_t edge = 0; edge < topology_.edgeCount(); edge++) {
            const auto [half, twin] = topology_.halves[edge];
            const bool is_seam = twin != none && edgeValue(half) != edgeValue(twin);
            const double sharp = is_seam ? 1.0 : std::min(topology_.sharpness[edge], 1.0f);
            const double end = smooth_end + (0.5 - smooth_end) * sharp;
            for (const uint32_t side : {half, twin}) {
                if (side == none || (side == twin && !is_seam)) continue;
                addTo(made(edgeValue(side)), old(indices_[side]), end, n);
                addTo(made(edgeValue(side)), old(indices_[topology_.next(side)]), end, n);
            }
            if (sharp >= 1.0) continue;
            for (const uint32_t side : {half, twin})
                addTo(made(edgeValue(half)),
                      catmull_clark ? made(faceValue(topology_.faces[side])) : old(indices_[topology_.previous(side)]),
                      0.5 - end, n);
        }
    }

    void setVertices(const std::vector<VertexRule>& rules) {
        const uint32_t n = channel_.components;
        const auto rule = [&](uint32_t corner) {
            const uint32_t vertex = topology_.vertices[corner];
            return kept_.empty() || !kept_[vertex] ? rules[vertex] : VertexRule{};
        };
        if (channel_.indices.empty()) {
            for (uint32_t vertex = 0; vertex < topology_.vertex_count; vertex++)
                addTo(made(vertex), old(vertex), rules[vertex].self, n);
        } else {
            std::vector<bool> begun(channel_.count(), false);
            for (uint32_t corner = 0; corner < topology_.cornerCount(); corner++) {
                if (begun[indices_[corner]]) continue;
                begun[indices_[corner]] = true;
                addTo(made(indices_[corner]), old(indices_[corner]), rule(corner).self, n);
            }
        }
        // The smooth rule is for vertices inside, where each edge begins one half-edge.
        for (uint32_t half = 0; half < topology_.cornerCount(); half++) {
            const VertexRule r = rule(half);
            if (r.edge == 0.0) continue;
            double* sum = made(indices_[half]);
            addTo(sum, old(indices_[topology_.next(half)]), r.edge, n);
            if (r.face != 0.0) addTo(sum, made(faceValue(topology_.faces[half])), r.face, n);
        }
        for (uint32_t edge = 0; edge < topology_.edgeCount(); edge++) {
            if (topology_.sharpness[edge] <= 0.0f) continue;
            const uint32_t from = topology_.halves[edge][0], to = topology_.next(from);
            for (const auto& [here, there] : {std::pair(from, to), std::pair(to, from)}) {
                const VertexRule r = rule(here);
                if (r.crease != 0.0 && topology_.sharpness[edge] > r.threshold)
                    addTo(made(indices_[here]), old(indices_[there]), r.crease, n);
            }
        }
    }

    const Topology& topology_;
    const Channel& channel_;
    const std::vector<uint32_t>& indices_;
    const Subdivision scheme_;
    double* values_ = nullptr;
    std::vector<uint32_t> edge_values_;  // the first value of each edge, one more than edges; empty: one each
    std::vector<bool> kept_;             // vertices on seams
    uint32_t seams_ = 0;
    uint32_t first_edge_ = 0;
    uint32_t first_face_ = 0;
};

/// The indices of the finer channel. Catmull-Clark: corner c becomes the face (vertex, edge after, face, edge before).
/// Loop: it becomes the triangle (vertex, edge after, edge before), and the middle follows a face's three.
std::vector<uint32_t> finerIndices(const Topology& topology, const ChannelStep& step, Subdivision scheme) {
    std::vector<uint32_t> indices;
    indices.reserve(size_t{topology.cornerCount()} * 4);
    for (uint32_t face = 0; face < topology.faceCount(); face++) {
        const uint32_t first = topology.offsets[face], end = topology.offsets[face + 1];
        for (uint32_t corner = first; corner < end; corner++) {
            const uint32_t before = corner == first ? end - 1 : corner - 1;
            indices.push_back(step.cornerValue(corner));
            indices.push_back(step.edgeValue(corner));
            if (scheme == Subdivision::CatmullClark) indices.push_back(step.faceValue(face));
            indices.push_back(step.edgeValue(before));
        }
        if (scheme == Subdivision::Loop)
            for (uint32_t corner = first; corner < end; corner++) indices.push_back(step.edgeValue(corner));
    }
    return indices;
}

/// The finer edges follow from the coarse ones: edge e splits into 2e, at the origin of its first half-edge, and 2e +
/// 1; then comes the edge within a face that belongs to each corner (Catmull-Clark: from the edge after it to the
/// face's centroid; Loop: from the edge after it to the edge before it).
Topology finerTopology(const Topology& coarse, Subdivision scheme) {
    const bool catmull_clark = scheme == Subdivision::CatmullClark;
    const uint32_t corners = catmull_clark ? 4 : 3;  // of a finer face
    Topology fine;
    const uint32_t face_count = catmull_clark ? coarse.cornerCount() : coarse.faceCount() * 4;
    const uint32_t inner = coarse.edgeCount() * 2;
    fine.vertex_count = coarse.vertex_count + coarse.edgeCount() + (catmull_clark ? coarse.faceCount() : 0);
    fine.offsets.resize(size_t{face_count} + 1);
    for (uint32_t face = 0; face <= face_count; face++) fine.offsets[face] = face * corners;
    fine.faces.resize(size_t{face_count} * corners);
    for (uint32_t half = 0; half < fine.faces.size(); half++) fine.faces[half] = half / corners;
    fine.edges.resize(fine.faces.size());
    fine.halves.assign(size_t{inner} + coarse.cornerCount(), {none, none});
    fine.sharpness.assign(fine.halves.size(), 0.0f);
    for (uint32_t edge = 0; edge < coarse.edgeCount(); edge++)
        fine.sharpness[2 * edge] = fine.sharpness[2 * edge + 1] = std::max(coarse.sharpness[edge] - 1.0f, 0.0f);

    const auto join = [&](uint32_t half, uint32_t edge) {
        fine.edges[half] = edge;
        auto& halves = fine.halves[edge];
        halves[halves[0] == none ? 0 : 1] = half;
    };
    for (uint32_t face = 0; face < coarse.faceCount(); face++) {
        const uint32_t first = coarse.offsets[face], end = coarse.offsets[face + 1];
        for (uint32_t corner = first; corner < end; corner++) {
            const uint32_t before = corner == first ? end - 1 : corner - 1;
            // The finer face of a corner, and its half-edges.
            const uint32_t half = (catmull_clark ? corner : 4 * face + (corner - first)) * corners;
            join(half, 2 * coarse.edges[corner] + coarse.isSecond(corner));
            join(half + 1, inner + corner);
            if (catmull_clark) join(half + 2, inner + before);
            join(half + corners - 1, 2 * coarse.edges[before] + 1 - coarse.isSecond(before));
            // From the edge after this corner to the edge after the next, which is the next corner's inner edge.
            if (!catmull_clark) join((4 * face + 3) * 3 + (corner - first), inner + coarse.next(corner));
        }
    }
    return fine;
}

/// What `steps` of refinement come to, without doing them.
Status checkSize(const Surface& surface, Subdivision scheme, uint32_t steps, uint64_t limit) {
    const bool catmull_clark = scheme == Subdivision::CatmullClark;
    uint64_t corners = surface.topology.cornerCount(), faces = surface.topology.faceCount();
    uint64_t edges = surface.topology.edgeCount();
    std::vector<uint64_t> values;
    values.reserve(surface.channels.size());
    for (const Channel& channel : surface.channels) values.push_back(channel.count());
    for (uint32_t step = 0;; step++) {
        uint64_t bytes = (corners + faces) * sizeof(uint32_t);
        for (size_t i = 0; i < values.size(); i++)
            bytes += values[i] * surface.channels[i].components * sizeof(float) +
                     (surface.channels[i].indices.empty() ? 0 : corners * sizeof(uint32_t));
        if (corners > UINT32_MAX - 1 || bytes > limit)
            return makeError(ErrorCode::OutOfRange, "refine.too_large",
                             "step {} of {} has {} faces with {} corners, which take {} bytes; at most {} corners and "
                             "{} bytes are allowed",
                             step, steps, faces, corners, bytes, UINT32_MAX - 1, limit);
        if (step == steps) return {};
        for (size_t i = 0; i < values.size(); i++)
            values[i] += edges * (surface.channels[i].indices.empty() ? 1 : 2) + (catmull_clark ? faces : 0);
        edges = 2 * edges + corners;
        faces = catmull_clark ? corners : 4 * faces;
        corners *= 4;
    }
}

}  // namespace

Surface refineOnce(const Surface& surface, Subdivision scheme) {
    const std::vector<VertexRule> rules = vertexRules(surface.topology, scheme);
    Surface finer;
    finer.topology = finerTopology(surface.topology, scheme);
    for (const Channel& channel : surface.channels) {
        ChannelStep step(surface.topology, channel, scheme);
        finer.channels.push_back(step.refine(rules));
        std::vector<uint32_t> indices = finerIndices(surface.topology, step, scheme);
        (channel.indices.empty() ? finer.topology.vertices : finer.channels.back().indices) = std::move(indices);
    }
    return finer;
}

Expected<Surface> refineSurface(const PolygonMesh& cage, Subdivision scheme, uint32_t steps, uint64_t limit) {
    Expected<Surface> surface = makeSurface(cage, scheme);
    if (!surface) return surface;
    if (Status status = checkSize(*surface, scheme, steps, limit); !status) return unexpected(status.error());
    for (uint32_t step = 0; step < steps; step++) *surface = refineOnce(*surface, scheme);
    return surface;
}

PolygonMesh toPolygonMesh(Surface&& surface, const PolygonMesh& cage) {
    PolygonMesh mesh;
    Topology& topology = surface.topology;
    for (uint32_t edge = 0; edge < topology.edgeCount(); edge++) {
        const auto [half, twin] = topology.halves[edge];
        if (twin != none && topology.sharpness[edge] > 0.0f)
            mesh.creases.push_back({.first = topology.vertices[half],
                                    .second = topology.vertices[twin],
                                    .sharpness = topology.sharpness[edge]});
    }
    const std::vector<double>& positions = surface.channels.front().values;
    mesh.positions.resize(positions.size() / 3);
    for (size_t i = 0; i < mesh.positions.size(); i++)
        mesh.positions[i] = Vector3f(Vector3d(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]));
    mesh.offsets = std::move(topology.offsets);
    mesh.indices = std::move(topology.vertices);
    size_t next = 1;
    for (const PolygonAttribute& attribute : cage.attributes) {
        if (attribute.name == "normal") continue;
        Channel& channel = surface.channels[next++];
        mesh.attributes.push_back({.name = attribute.name,
                                   .components = attribute.components,
                                   .values = {channel.values.begin(), channel.values.end()},
                                   .indices = std::move(channel.indices)});
    }
    return mesh;
}

}  // namespace detail

Expected<PolygonMesh> refine(const PolygonMesh& cage, Subdivision scheme, uint32_t steps, uint64_t limit) {
    Expected<detail::Surface> surface = detail::refineSurface(cage, scheme, steps, limit);
    if (!surface) return unexpected(surface.error());
    return detail::toPolygonMesh(std::move(*surface), cage);
}

}  // namespace glint
