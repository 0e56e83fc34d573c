#include <glint/geometry/detail/subdivision.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <limits>

namespace glint::detail {

namespace {

/// A half-edge under the vertices of its edge, the lower one first.
struct Side {
    uint64_t edge;
    uint32_t half;
    bool operator<(const Side& other) const { return edge != other.edge ? edge < other.edge : half < other.half; }
};

uint64_t edgeKey(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

Status joinEdges(Topology& topology) {
    std::vector<Side> sides(topology.cornerCount());
    for (uint32_t half = 0; half < topology.cornerCount(); half++)
        sides[half] = {edgeKey(topology.vertices[half], topology.vertices[topology.next(half)]), half};
    std::sort(sides.begin(), sides.end());

    topology.edges.resize(sides.size());
    for (size_t i = 0; i < sides.size();) {
        size_t count = 1;
        while (i + count < sides.size() && sides[i + count].edge == sides[i].edge) count++;
        const uint32_t half = sides[i].half;
        const uint32_t other = count > 1 ? sides[i + 1].half : none;
        const uint32_t from = topology.vertices[half], to = topology.vertices[topology.next(half)];
        if (count > 2)
            return makeError(ErrorCode::InvalidArgument, "refine.edge_faces",
                             "the edge from vertex {} to vertex {} belongs to {} faces ({}, {}, {}{}), at most 2 are "
                             "allowed",
                             from, to, count, topology.faces[half], topology.faces[other],
                             topology.faces[sides[i + 2].half], count > 3 ? ", ..." : "");
        if (count == 2 && topology.vertices[other] == from)
            return makeError(
                ErrorCode::InvalidArgument, "refine.edge_direction",
                "faces {} and {} run along the edge from vertex {} to vertex {} in the same direction: one "
                "of them faces the other way",
                topology.faces[half], topology.faces[other], from, to);
        for (size_t k = 0; k < count; k++) topology.edges[sides[i + k].half] = topology.edgeCount();
        topology.halves.push_back({half, other});
        i += count;
    }
    return {};
}

/// Walks around every vertex: all its corners have to be met.
Status checkFans(const Topology& topology) {
    std::vector<uint32_t> corners(topology.vertex_count, 0);
    std::vector<uint32_t> starts(topology.vertex_count, none);
    for (uint32_t half = 0; half < topology.cornerCount(); half++) {
        const uint32_t vertex = topology.vertices[half];
        corners[vertex]++;
        if (starts[vertex] == none || topology.twin(half) == none) starts[vertex] = half;
    }
    for (uint32_t vertex = 0; vertex < topology.vertex_count; vertex++) {
        if (corners[vertex] == 0) continue;
        uint32_t met = 0;
        uint32_t half = starts[vertex];
        do {
            met++;
            half = topology.twin(topology.previous(half));
        } while (half != none && half != starts[vertex]);
        if (met != corners[vertex])
            return makeError(ErrorCode::InvalidArgument, "refine.vertex_fans",
                             "of the {} faces at vertex {} only {} are joined by edges to face {}, all have to be",
                             corners[vertex], vertex, met, topology.faces[starts[vertex]]);
    }
    return {};
}

Status setSharpness(Topology& topology, const std::vector<PolygonCrease>& creases) {
    topology.sharpness.assign(topology.edgeCount(), 0.0f);
    if (!creases.empty()) {
        std::vector<std::pair<uint64_t, uint32_t>> edges(topology.edgeCount());
        for (uint32_t edge = 0; edge < edges.size(); edge++) {
            const uint32_t half = topology.halves[edge][0];
            edges[edge] = {edgeKey(topology.vertices[half], topology.vertices[topology.next(half)]), edge};
        }
        std::sort(edges.begin(), edges.end());
        for (const PolygonCrease& crease : creases) {
            const std::pair<uint64_t, uint32_t> key = {edgeKey(crease.first, crease.second), 0};
            const auto found = std::lower_bound(edges.begin(), edges.end(), key);
            if (found == edges.end() || found->first != key.first)
                return makeError(ErrorCode::InvalidArgument, "refine.crease_edge",
                                 "the crease from vertex {} to vertex {} is no edge of a face", crease.first,
                                 crease.second);
            float& sharpness = topology.sharpness[found->second];
            sharpness = std::max(sharpness, crease.sharpness);
        }
    }
    for (uint32_t edge = 0; edge < topology.edgeCount(); edge++)
        if (topology.halves[edge][1] == none) topology.sharpness[edge] = std::numeric_limits<float>::infinity();
    return {};
}

/// A channel whose values belong to one vertex each: what several vertices share is copied, what none uses is dropped.
Channel makeChannel(const PolygonAttribute& attribute, const Topology& topology) {
    std::vector<std::pair<uint64_t, uint32_t>> uses(topology.cornerCount());  // (vertex, value), corner
    for (uint32_t corner = 0; corner < topology.cornerCount(); corner++)
        uses[corner] = {uint64_t{topology.vertices[corner]} << 32 | attribute.indices[corner], corner};
    std::sort(uses.begin(), uses.end());

    Channel channel{.components = attribute.components, .values = {}, .indices = {}};
    channel.indices.resize(uses.size());
    for (size_t i = 0; i < uses.size(); i++) {
        if (i == 0 || uses[i].first != uses[i - 1].first) {
            const auto* values = &attribute.values[size_t{attribute.indices[uses[i].second]} * attribute.components];
            channel.values.insert(channel.values.end(), values, values + attribute.components);
        }
        channel.indices[uses[i].second] = static_cast<uint32_t>(channel.count() - 1);
    }
    return channel;
}

}  // namespace

Expected<Surface> makeSurface(const PolygonMesh& cage, Subdivision scheme) {
    if (Status status = cage.validate(); !status) return unexpected(status.error());
    Surface surface;
    Topology& topology = surface.topology;
    topology.vertex_count = static_cast<uint32_t>(cage.positions.size());
    topology.offsets = cage.offsets;
    topology.vertices = cage.indices;
    topology.faces.resize(cage.indices.size());
    for (uint32_t face = 0; face < topology.faceCount(); face++) {
        const uint32_t first = cage.offsets[face], end = cage.offsets[face + 1];
        if (scheme == Subdivision::Loop && end - first != 3)
            return unexpected(makeError(ErrorCode::InvalidArgument, "refine.not_triangles",
                                        "face {} has {} corners, Loop's scheme refines triangles only", face,
                                        end - first));
        std::fill(topology.faces.begin() + first, topology.faces.begin() + end, face);
    }
    if (Status status = joinEdges(topology); !status) return unexpected(status.error());
    if (Status status = checkFans(topology); !status) return unexpected(status.error());
    if (Status status = setSharpness(topology, cage.creases); !status) return unexpected(status.error());

    Channel positions{.components = 3, .values = {}, .indices = {}};
    positions.values.reserve(cage.positions.size() * 3);
    for (const Vector3f& p : cage.positions) positions.values.insert(positions.values.end(), {p.x, p.y, p.z});
    surface.channels.push_back(std::move(positions));
    for (const PolygonAttribute& attribute : cage.attributes)
        if (attribute.name != "normal") surface.channels.push_back(makeChannel(attribute, topology));
    return surface;
}

}  // namespace glint::detail
