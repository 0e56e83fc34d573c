#include <glint/format/mesh_graph.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>

#include <bit>
#include <cstring>

namespace glint {

namespace {

enum SectionName : size_t {
    Positions,
    Normals,
    Texcoords,
    Clusters,
    Groups,
    Parents,
    ClusterVertices,
    ClusterTriangles,
    Parts,
    Names,
    SectionCount,
};

struct PartRecord {
    uint32_t material;
    uint32_t name_size;
};

constexpr std::array<uint64_t, SectionCount> element_sizes = {
    sizeof(Vector3f), sizeof(Vector3f), sizeof(Vector2f), sizeof(MeshCluster), sizeof(MeshClusterGroup),
    sizeof(uint32_t), sizeof(uint32_t), sizeof(uint32_t), sizeof(PartRecord),  1};
constexpr std::array<const char*, SectionCount> section_names = {
    "positions", "normals",          "texture coordinates", "clusters", "groups",
    "parents",   "cluster vertices", "cluster triangles",   "parts",    "bytes of names"};

struct Header {
    std::array<char, 8> magic;
    uint32_t version;
    uint32_t root_count;
    uint64_t size;
    std::array<uint64_t, SectionCount> counts;
    std::array<uint32_t, 6> reserved;
};
static_assert(sizeof(Header) == 128);
static_assert(std::endian::native == std::endian::little, "the file is the memory");

constexpr std::array<char, 8> magic = {'g', 'l', 'i', 'n', 't', 'L', 'O', 'D'};
constexpr uint32_t version = 1;

constexpr uint64_t aligned(uint64_t offset) { return (offset + 15) / 16 * 16; }

Error graphError(const char* id, std::string text) { return makeError(ErrorCode::InvalidArgument, id, "{}", text); }

/// Whether all are below 2^63 and none is NaN; the loop has no exits, so that it runs at the speed of memory.
bool areFinite(std::span<const std::byte> floats) {
    uint32_t largest = 0;
    const std::byte* data = floats.data();
    for (size_t i = 0; i + 4 <= floats.size(); i += 4) {
        uint32_t bits = 0;
        std::memcpy(&bits, data + i, 4);
        largest = std::max(largest, bits & 0x7fffffffu);
    }
    return largest < 0x5f000000u;
}

uint32_t largestOf(std::span<const uint32_t> values) {
    uint32_t largest = 0;
    for (const uint32_t value : values) largest = std::max(largest, value);
    return largest;
}

}  // namespace

template <class T>
std::span<const T> MeshGraph::array(size_t section) const {
    if (!data_) return {};
    const Section& s = sections_[section];
    return {reinterpret_cast<const T*>(data_.get() + s.offset), s.count};
}

std::span<const Vector3f> MeshGraph::positions() const { return array<Vector3f>(Positions); }
std::span<const Vector3f> MeshGraph::normals() const { return array<Vector3f>(Normals); }
std::span<const Vector2f> MeshGraph::texcoords() const { return array<Vector2f>(Texcoords); }
std::span<const MeshCluster> MeshGraph::clusters() const { return array<MeshCluster>(Clusters); }
std::span<const MeshClusterGroup> MeshGraph::groups() const { return array<MeshClusterGroup>(Groups); }
std::span<const uint32_t> MeshGraph::parents() const { return array<uint32_t>(Parents); }
std::span<const uint32_t> MeshGraph::clusterVertices() const { return array<uint32_t>(ClusterVertices); }
std::span<const uint32_t> MeshGraph::clusterTriangles() const { return array<uint32_t>(ClusterTriangles); }
uint32_t MeshGraph::rootCount() const { return root_count_; }

std::vector<MeshGraphPart> MeshGraph::parts() const {
    std::vector<MeshGraphPart> parts;
    const std::span<const char> names = array<char>(Names);
    size_t offset = 0;
    for (const PartRecord& record : array<PartRecord>(Parts)) {
        parts.push_back({std::string(names.data() + offset, record.name_size), record.material});
        offset += record.name_size;
    }
    return parts;
}

Expected<MeshGraph> MeshGraph::adopt(std::shared_ptr<const std::byte[]> data, uint64_t size) {
    Header header;
    if (size < sizeof(Header))
        return unexpected(graphError(
            "graph.size", fmt::format("{} bytes are fewer than the {} of the header", size, sizeof(Header))));
    std::memcpy(&header, data.get(), sizeof(Header));
    if (header.magic != magic)
        return unexpected(graphError("graph.magic", "the file does not begin with 'glintLOD': it is no mesh graph"));
    if (header.version != version)
        return unexpected(makeError(ErrorCode::Unsupported, "graph.version", "the file has version {}, this is {}",
                                    header.version, version));
    if (header.size != size)
        return unexpected(
            graphError("graph.size", fmt::format("the file says that it has {} bytes, it has {}", header.size, size)));
    MeshGraph graph;
    uint64_t offset = sizeof(Header);
    for (size_t i = 0; i < SectionCount; i++) {
        const uint64_t count = header.counts[i];
        if (count > UINT32_MAX)
            return unexpected(makeError(ErrorCode::OutOfRange, "graph.counts", "{} {}: at most {} are allowed", count,
                                        section_names[i], UINT32_MAX));
        graph.sections_[i] = {offset, count};
        offset += aligned(count * element_sizes[i]);  // no overflow: below 2^39 each
    }
    if (offset != size)
        return unexpected(graphError(
            "graph.size", fmt::format("what the file says to hold takes {} bytes, it has {}", offset, size)));
    graph.root_count_ = header.root_count;
    graph.data_ = std::move(data);
    graph.size_ = size;
    if (Status status = graph.check(); !status) return unexpected(status.error());
    return graph;
}

Status MeshGraph::check() const {
    const uint64_t vertices = positions().size();
    for (const size_t section : {Normals, Texcoords})
        if (const uint64_t count = sections_[section].count; count != 0 && count != vertices)
            return graphError("graph.counts",
                              fmt::format("{} {} for {} positions", count, section_names[section], vertices));
    for (const size_t section : {Positions, Normals, Texcoords})
        if (!areFinite({data_.get() + sections_[section].offset, sections_[section].count * element_sizes[section]}))
            return graphError("graph.not_finite",
                              fmt::format("one of the {} is NaN, or 2^63 or larger", section_names[section]));
    if (largestOf(clusterVertices()) >= vertices && !clusterVertices().empty())
        return makeError(ErrorCode::OutOfRange, "graph.index_range", "a cluster names vertex {} of {}",
                         largestOf(clusterVertices()), vertices);
    uint64_t name_bytes = 0;
    for (const PartRecord& record : array<PartRecord>(Parts)) name_bytes += record.name_size;
    if (name_bytes != sections_[Names].count)
        return graphError("graph.counts",
                          fmt::format("the parts' names take {} bytes of {}", name_bytes, sections_[Names].count));
    if (Status status = checkClusters(); !status) return status;
    return checkGroups();
}

Status MeshGraph::checkClusters() const {
    const std::span<const MeshCluster> all = clusters();
    const std::span<const uint32_t> triangles = clusterTriangles();
    const auto fail = [](size_t cluster, const std::string& text) {
        return graphError("graph.cluster", fmt::format("cluster {}: {}", cluster, text));
    };
    if (root_count_ > all.size())
        return graphError("graph.counts", fmt::format("{} roots of {} clusters", root_count_, all.size()));
    uint64_t first_vertex = 0, first_triangle = 0;
    for (size_t i = 0; i < all.size(); i++) {
        const MeshCluster& c = all[i];
        const uint32_t vertex_count = c.vertexCount(), triangle_count = c.triangleCount();
        if (vertex_count < 3 || vertex_count > MeshCluster::max_vertices || triangle_count < 1 ||
            triangle_count > MeshCluster::max_triangles)
            return fail(i, fmt::format("{} vertices and {} triangles; at most {} and {} are allowed", vertex_count,
                                       triangle_count, MeshCluster::max_vertices, MeshCluster::max_triangles));
        if (c.first_vertex != first_vertex || c.first_triangle != first_triangle)
            return fail(i, fmt::format("begins with vertex {} and triangle {}, the one before ends at {} and {}",
                                       c.first_vertex, c.first_triangle, first_vertex, first_triangle));
        first_vertex += vertex_count;
        first_triangle += triangle_count;
        if (first_vertex > clusterVertices().size() || first_triangle > triangles.size())
            return fail(i, "ends past the vertices or triangles of the clusters");
        uint32_t a = 0, b = 0, d = 0, high = 0;
        for (const uint32_t packed : triangles.subspan(c.first_triangle, triangle_count)) {
            a = std::max(a, packed & 0x3ffu);
            b = std::max(b, packed >> 10 & 0x3ffu);
            d = std::max(d, packed >> 20 & 0x3ffu);
            high |= packed >> 30;
        }
        if (std::max({a, b, d}) >= vertex_count || high != 0)
            return makeError(ErrorCode::OutOfRange, "graph.index_range", "cluster {}: a triangle names vertex {} of {}",
                             i, std::max({a, b, d}), vertex_count);
        if (c.part >= sections_[Parts].count)
            return fail(i, fmt::format("part {} of {}", c.part, sections_[Parts].count));
        if (c.source != UINT32_MAX && c.source >= groups().size())
            return fail(i, fmt::format("source {} of {} groups", c.source, groups().size()));
        if ((c.group == UINT32_MAX) != (i < root_count_) || (c.group != UINT32_MAX && c.group >= groups().size()))
            return fail(i, fmt::format("group {} of {} with {} roots", c.group, groups().size(), root_count_));
        const std::array bounds = {Vector4f(c.center, c.radius), Vector4f(c.cone_axis, c.cone_cutoff),
                                   Vector4f(c.box_min, 0.0f), Vector4f(c.box_max, 0.0f)};
        if (!areFinite(std::as_bytes(std::span(bounds))))
            return graphError("graph.not_finite", fmt::format("cluster {}: a bound is NaN, or 2^63 or larger", i));
    }
    if (first_vertex != clusterVertices().size() || first_triangle != triangles.size())
        return graphError("graph.counts",
                          fmt::format("the clusters have {} vertices of {} and {} triangles of {}", first_vertex,
                                      clusterVertices().size(), first_triangle, triangles.size()));
    return {};
}

Status MeshGraph::checkGroups() const {
    const std::span<const MeshCluster> all = clusters();
    for (size_t i = 0; i < groups().size(); i++)
        if (!areFinite(std::as_bytes(groups().subspan(i, 1)).first(offsetof(MeshClusterGroup, level))) ||
            !(groups()[i].error >= 0.0f))
            return graphError("graph.not_finite",
                              fmt::format("group {}: a bound or the error is NaN, negative, or 2^63 or larger", i));
    uint64_t child = root_count_, parent = 0;
    for (size_t i = 0; i < groups().size(); i++) {
        const MeshClusterGroup& group = groups()[i];
        const auto fail = [i](const char* id, const std::string& text) {
            return graphError(id, fmt::format("group {}: {}", i, text));
        };
        if (group.first_child != child || group.first_parent != parent || group.child_count == 0 ||
            group.parent_count == 0)
            return fail("graph.group", fmt::format("begins with child {} and parent {}, the one before ends at {} and "
                                                   "{}; it has {} children and {} parents",
                                                   group.first_child, group.first_parent, child, parent,
                                                   group.child_count, group.parent_count));
        child += group.child_count;
        parent += group.parent_count;
        if (child > all.size() || parent > parents().size())
            return fail("graph.group", "ends past the clusters or the parents");
        for (const uint32_t cluster : parents().subspan(group.first_parent, group.parent_count))
            if (cluster >= all.size() || all[cluster].source != i)
                return fail("graph.group", fmt::format("its parent {} has another source", cluster));
        for (const MeshCluster& cluster : all.subspan(group.first_child, group.child_count)) {
            if (cluster.group != i) return fail("graph.group", "its children belong to another group");
            const bool is_leaf = cluster.source == UINT32_MAX;
            if (!is_leaf && cluster.source <= i)
                return fail("graph.order", fmt::format("contains group {}, which comes before", cluster.source));
            const MeshClusterGroup* inner = is_leaf ? nullptr : &groups()[cluster.source];
            if (inner && !(inner->error <= group.error))
                return fail("graph.order", fmt::format("its error is {}, that of group {} within it {}", group.error,
                                                       cluster.source, inner->error));
            const Vector3d center(inner ? inner->center : cluster.center);
            const double radius = inner ? inner->radius : cluster.radius;
            if (glm::distance(center, Vector3d(group.center)) + radius > group.radius)
                return fail("graph.order", "its ball does not hold the balls of what it contains");
        }
    }
    // Each cluster with a source is one of that group's parents: there are as many of either.
    uint64_t simplified = 0;
    for (const MeshCluster& cluster : all) simplified += cluster.source != UINT32_MAX;
    if (child != all.size() || parent != parents().size() || parent != simplified)
        return graphError("graph.counts",
                          fmt::format("the groups have {} children and {} parents, of {} and {}", child - root_count_,
                                      parent, all.size() - root_count_, simplified));
    // A parent named twice would leave another one out, and a walk would never come there.
    std::vector<bool> named(all.size(), false);
    for (const uint32_t cluster : parents()) {
        if (named[cluster]) return graphError("graph.group", fmt::format("cluster {} is a parent twice", cluster));
        named[cluster] = true;
    }
    return {};
}

Expected<MeshGraph> MeshGraph::create(const MeshGraphArrays& arrays) {
    std::vector<PartRecord> records;
    std::string names;
    for (const MeshGraphPart& part : arrays.parts) {
        records.push_back({part.material, static_cast<uint32_t>(part.name.size())});
        names += part.name;
    }
    const std::array<std::span<const std::byte>, SectionCount> contents = {
        std::as_bytes(std::span(arrays.positions)),
        std::as_bytes(std::span(arrays.normals)),
        std::as_bytes(std::span(arrays.texcoords)),
        std::as_bytes(std::span(arrays.clusters)),
        std::as_bytes(std::span(arrays.groups)),
        std::as_bytes(std::span(arrays.parents)),
        std::as_bytes(std::span(arrays.cluster_vertices)),
        std::as_bytes(std::span(arrays.cluster_triangles)),
        std::as_bytes(std::span(records)),
        std::as_bytes(std::span(names)),
    };
    Header header = {};
    header.magic = magic;
    header.version = version;
    header.root_count = arrays.root_count;
    header.size = sizeof(Header);
    for (size_t i = 0; i < SectionCount; i++) {
        header.counts[i] = contents[i].size() / element_sizes[i];
        header.size += aligned(contents[i].size());
    }
    const std::shared_ptr<std::byte[]> data = std::make_shared<std::byte[]>(header.size);
    std::memcpy(data.get(), &header, sizeof(Header));
    uint64_t offset = sizeof(Header);
    for (const std::span<const std::byte>& content : contents) {
        if (!content.empty()) std::memcpy(data.get() + offset, content.data(), content.size());
        offset += aligned(content.size());
    }
    return adopt(data, header.size);
}

Expected<MeshGraph> MeshGraph::load(const std::filesystem::path& path, uint64_t limit) {
    const Expected<InputFile> file = InputFile::open(path);
    if (!file) return unexpected(file.error());
    if (file->size() > limit)
        return unexpected(makeError(ErrorCode::Io, "file.too_large", "'{}' has {} bytes, the limit is {}",
                                    path.string(), file->size(), limit));
    // Not cleared before: that would cost as much as the reading.
    const auto data = std::make_shared_for_overwrite<std::byte[]>(file->size());
    if (Status status = file->read(0, {data.get(), file->size()}); !status) return unexpected(status.error());
    Expected<MeshGraph> graph = adopt(data, file->size());
    if (graph) return graph;
    const Error& error = graph.error();
    return unexpected(Error::inFile(error.code(), error.id().data(), error.message(), path.filename().string(), 0));
}

Expected<MeshGraph> MeshGraph::decode(std::span<const std::byte> bytes, const std::string& name) {
    const auto data = std::make_shared_for_overwrite<std::byte[]>(bytes.size());
    if (!bytes.empty()) std::memcpy(data.get(), bytes.data(), bytes.size());
    Expected<MeshGraph> graph = adopt(data, bytes.size());
    if (graph) return graph;
    const Error& error = graph.error();
    return unexpected(Error::inFile(error.code(), error.id().data(), error.message(), name, 0));
}

Status MeshGraph::save(const std::filesystem::path& path) const {
    if (data_) return writeFile(path, bytes());
    const Expected<MeshGraph> empty = create({});
    return empty ? writeFile(path, empty->bytes()) : Status(empty.error());
}

}  // namespace glint
