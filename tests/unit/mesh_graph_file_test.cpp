// Files of graphs of levels of detail: what is written is read, and what is broken is refused with a reason.

#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

const MeshGraph& graph() {
    static const MeshGraph value = [] {
        Mesh mesh = createTorus(2.0f, 0.7f, 60, 24);
        mesh.parts = {{"a", 0, 3000, 1}, {"b", 3000, static_cast<uint32_t>(mesh.indices.size()) - 3000, 2}};
        return *createMeshGraph(mesh, {.group_clusters = 4});
    }();
    return value;
}

template <class T>
std::vector<T> copy(std::span<const T> values) {
    return {values.begin(), values.end()};
}

MeshGraphArrays arrays() {
    const MeshGraph& g = graph();
    return {.positions = copy(g.positions()),
            .normals = copy(g.normals()),
            .texcoords = copy(g.texcoords()),
            .clusters = copy(g.clusters()),
            .groups = copy(g.groups()),
            .parents = copy(g.parents()),
            .cluster_vertices = copy(g.clusterVertices()),
            .cluster_triangles = copy(g.clusterTriangles()),
            .parts = g.parts(),
            .root_count = g.rootCount()};
}

std::vector<std::byte> bytes() { return copy(graph().bytes()); }

}  // namespace

TEST(MeshGraphFile, WhatIsWrittenIsRead) {
    const TempDir dir;
    ASSERT_THAT(graph().save(dir / "a.lod"), IsOk());
    const Expected<MeshGraph> loaded = MeshGraph::load(dir / "a.lod");
    ASSERT_THAT(loaded, IsOk());
    EXPECT_TRUE(std::ranges::equal(loaded->bytes(), graph().bytes()));
    EXPECT_EQ(loaded->mesh(loaded->cut(0.01f)), graph().mesh(graph().cut(0.01f)));
    EXPECT_EQ(loaded->parts(), graph().parts());
    EXPECT_GT(loaded->groups().size(), 5u);
    const Expected<MeshGraph> again = MeshGraph::create(arrays());
    ASSERT_THAT(again, IsOk());
    EXPECT_TRUE(std::ranges::equal(again->bytes(), graph().bytes()));

    ASSERT_THAT(MeshGraph().save(dir / "empty.lod"), IsOk());
    const Expected<MeshGraph> empty = MeshGraph::load(dir / "empty.lod");
    ASSERT_THAT(empty, IsOk());
    EXPECT_TRUE(empty->cut(0.0f).empty());
    EXPECT_TRUE(MeshGraph().cut(0.0f).empty());
    EXPECT_THAT(MeshGraph::load(dir / "none.lod"), HasErrorId("file.open"));
    EXPECT_THAT(MeshGraph::load(dir / "a.lod", 1000), HasErrorId("file.too_large"));
}

TEST(MeshGraphFile, BrokenFilesAreRefused) {
    const auto expect = [](std::vector<std::byte> file, const char* id) {
        const Expected<MeshGraph> broken = MeshGraph::decode(file, "broken.lod");
        ASSERT_THAT(broken, HasErrorId(id));
        EXPECT_EQ(broken.error().file(), "broken.lod");
    };
    const auto with = [](size_t offset, uint64_t value, size_t size) {
        std::vector<std::byte> file = bytes();
        std::memcpy(file.data() + offset, &value, size);
        return file;
    };
    expect({}, "graph.size");
    const std::vector<std::byte> whole = bytes();
    for (const size_t size : {size_t{1}, size_t{127}, size_t{128}, whole.size() - 1}) {
        std::vector<std::byte> shorter = whole;
        shorter.resize(size);
        expect(shorter, "graph.size");
    }
    std::vector<std::byte> longer = bytes();
    longer.resize(longer.size() + 16);
    expect(longer, "graph.size");
    expect(with(0, 'x', 1), "graph.magic");
    expect(with(8, 2, 4), "graph.version");
    expect(with(16, 1, 8), "graph.size");
    for (size_t i = 0; i < 10; i++) {
        expect(with(24 + 8 * i, uint64_t{1} << 32, 8), "graph.counts");
        expect(with(24 + 8 * i, UINT64_MAX, 8), "graph.counts");
        expect(with(24 + 8 * i, UINT32_MAX, 8), "graph.size");
        if (i != 2) expect(with(24 + 8 * i, 0, 8), "graph.size");  // there are no texture coordinates
    }
}

// Each of them would make a walk, or a shader, leave an array, go round for ever or draw twice.
TEST(MeshGraphFile, BrokenGraphsAreRefused) {
    const auto expect = [](const char* id, auto&& change) {
        MeshGraphArrays broken = arrays();
        change(broken);
        EXPECT_THAT(MeshGraph::create(broken), HasErrorId(id));
    };
    using A = MeshGraphArrays;
    ASSERT_THAT(MeshGraph::create(arrays()), IsOk());
    expect("graph.counts", [](A& a) { a.normals.pop_back(); });
    expect("graph.counts", [](A& a) { a.texcoords.resize(3); });
    expect("graph.counts", [](A& a) { a.cluster_vertices.push_back(0); });
    expect("graph.counts", [](A& a) { a.cluster_triangles.push_back(0); });
    expect("graph.counts", [](A& a) { a.root_count = UINT32_MAX; });
    expect("graph.counts", [](A& a) { a.parents.push_back(0); });
    expect("graph.not_finite", [](A& a) { a.positions[7].y = NAN; });
    expect("graph.not_finite", [](A& a) { a.normals[7].y = -INFINITY; });
    expect("graph.not_finite", [](A& a) { a.positions[7].y = 1e19f; });
    expect("graph.not_finite", [](A& a) { a.clusters[3].radius = NAN; });
    expect("graph.not_finite", [](A& a) { a.clusters[3].box_max.z = INFINITY; });
    expect("graph.not_finite", [](A& a) { a.groups[1].error = NAN; });
    expect("graph.not_finite", [](A& a) { a.groups.back().error = -1.0f; });
    expect("graph.not_finite", [](A& a) { a.groups[1].box_min.x = NAN; });
    expect("graph.index_range", [](A& a) { a.cluster_vertices[9] = static_cast<uint32_t>(a.positions.size()); });
    expect("graph.index_range", [](A& a) { a.cluster_triangles[9] |= 0x3ff; });
    expect("graph.index_range", [](A& a) { a.cluster_triangles[9] |= 0x3ff << 10; });
    expect("graph.index_range", [](A& a) { a.cluster_triangles[9] |= 0x3ff << 20; });
    expect("graph.index_range", [](A& a) { a.cluster_triangles[9] |= 1u << 31; });
    expect("graph.cluster", [](A& a) { a.clusters[2].counts = 0; });
    expect("graph.cluster", [](A& a) { a.clusters[2].counts = 129 | 10 << 16; });
    expect("graph.cluster", [](A& a) { a.clusters[2].counts = 100 | 129 << 16; });
    expect("graph.cluster", [](A& a) { a.clusters[2].first_vertex++; });
    expect("graph.cluster", [](A& a) { a.clusters[2].first_triangle = UINT32_MAX; });
    expect("graph.cluster", [](A& a) { a.clusters[2].part = 2; });
    expect("graph.cluster", [](A& a) { a.clusters[0].group = 0; });
    expect("graph.cluster", [](A& a) { a.clusters.back().group = UINT32_MAX; });
    expect("graph.cluster", [](A& a) { a.clusters.back().group = 1u << 30; });
    expect("graph.cluster", [](A& a) { a.clusters[0].source = 1u << 30; });
    expect("graph.group", [](A& a) { a.clusters[0].source++; });
    expect("graph.group", [](A& a) { a.groups[0].first_child++; });
    expect("graph.group", [](A& a) { a.groups[1].first_parent = UINT32_MAX; });
    expect("graph.group", [](A& a) { a.groups[1].child_count = 0; });
    expect("graph.group", [](A& a) { a.groups[1].parent_count = 0; });
    expect("graph.group", [](A& a) { a.groups.back().child_count = UINT32_MAX; });
    expect("graph.group", [](A& a) { a.groups.back().parent_count = UINT32_MAX; });
    expect("graph.group", [](A& a) { a.parents[0] = UINT32_MAX; });
    expect("graph.group", [](A& a) { a.parents[0] = static_cast<uint32_t>(a.clusters.size()) - 1; });
    expect("graph.group", [](A& a) {
        for (const MeshClusterGroup& group : a.groups)
            if (group.parent_count > 1) a.parents[group.first_parent] = a.parents[group.first_parent + 1];
    });
    expect("graph.order", [](A& a) { a.groups[0].error = 0.0f; });
    expect("graph.order", [](A& a) { a.groups[0].radius *= 0.5f; });
    expect("graph.order", [](A& a) { a.groups.back().center.x += 1.0f; });
    // A group that contains itself: its child is its parent.
    expect("graph.order", [](A& a) {
        const MeshClusterGroup& last = a.groups.back();
        a.clusters[last.first_child].source = static_cast<uint32_t>(a.groups.size()) - 1;
        a.parents[last.first_parent] = last.first_child;
    });
}

// Any single damaged word gives an error, or a graph that can be walked and shown.
TEST(MeshGraphFile, DamagedWords) {
    Random random(8);
    size_t refused = 0;
    for (int i = 0; i < 3000; i++) {
        std::vector<std::byte> file = bytes();
        for (int k = 0; k < 1 + i % 2; k++) {
            const size_t word = random.below(file.size() / 4) * 4;
            const auto value =
                i % 3 == 0 ? static_cast<uint32_t>(random.bits()) : static_cast<uint32_t>(random.below(300));
            std::memcpy(file.data() + word, &value, 4);
        }
        const Expected<MeshGraph> damaged = MeshGraph::decode(file, "damaged");
        if (!damaged) {
            refused++;
            continue;
        }
        if (i % 20 != 0) continue;
        for (const float error : {0.0f, 0.01f, 1.0f}) {
            const std::vector<uint32_t> cut = damaged->cut(error);
            EXPECT_LE(cut.size(), damaged->clusters().size());
            EXPECT_LE(damaged->mesh(cut).indices.size(), 3 * damaged->clusterTriangles().size());
        }
    }
    EXPECT_GT(refused, 300u);
}
