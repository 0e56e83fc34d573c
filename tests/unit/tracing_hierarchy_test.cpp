// Hierarchies of the software tracing engine, looked at on the CPU.

#include "support/hierarchies.h"
#include "support/hierarchy_walk.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/hierarchy.h>
#include <glint/tracing/detail/parallel.h>
#include <glint/tracing/detail/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

namespace glint::test {

namespace {

using namespace glint::detail;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

bool equal(const Hierarchy& a, const Hierarchy& b) {
    return a.bytes() == b.bytes() && std::memcmp(a.texels.data(), b.texels.data(), a.bytes()) == 0 &&
           a.runs == b.runs && a.depth == b.depth;
}

struct Kind {
    BuildMode mode;
    NodeForm form;
};
constexpr Kind all_kinds[] = {{BuildMode::Quality, NodeForm::Packed},
                              {BuildMode::Fast, NodeForm::Packed},
                              {BuildMode::Quality, NodeForm::Full},
                              {BuildMode::Fast, NodeForm::Full}};

/// Long thin triangles in all directions.
Mesh needles(uint32_t count, uint64_t seed) {
    test::Random random(seed);
    Mesh mesh;
    for (uint32_t i = 0; i < count; i++) {
        const Vector3d a = random.direction();
        const Vector3d along = random.direction();
        mesh.positions.push_back(Vector3f(a - along));
        mesh.positions.push_back(Vector3f(a + along));
        mesh.positions.push_back(Vector3f(a + 0.01 * random.direction()));
        for (uint32_t c = 0; c < 3; c++) mesh.indices.push_back(3 * i + c);
    }
    return mesh;
}

TEST(TracingHierarchy, SplitsHoldAllOfTheirTriangles) {
    const Mesh mesh = needles(5000, 8);
    const Hierarchy hierarchy = hierarchyOf(mesh, BuildMode::Split);
    EXPECT_GT(hierarchy.records, 5500u);
    EXPECT_LE(hierarchy.records, 8000u);
    for (const uint32_t threads : {1u, 3u}) {
        ThreadPool pool(threads);
        EXPECT_TRUE(equal(hierarchy, hierarchyOf(mesh, BuildMode::Split, &pool))) << threads << " threads";
    }

    // Points of each triangle lie in one of its boxes.
    const Header header = readHeader(hierarchy);
    Grid grid;
    std::copy_n(header.minimum, 3, grid.minimum);
    grid.step = header.step;
    struct Leaf {
        double lo[3], hi[3];
    };
    std::vector<std::vector<Leaf>> leaves(5000);
    for (uint32_t i = 1; i <= hierarchy.nodes; i++) {
        Node node;
        std::memcpy(&node, &hierarchy.texels[4 * size_t(i)], sizeof(node));
        for (uint32_t s = 0; s < node.leaves(); s++) {
            Record record;
            std::memcpy(&record, &hierarchy.texels[hierarchy.firstRecord() + 3 * size_t(node.record() + s)],
                        sizeof(record));
            Leaf leaf;
            node.box(grid, s, leaf.lo, leaf.hi);
            leaves[record.primitive].push_back(leaf);
        }
    }
    test::Random random(9);
    for (uint32_t i = 0; i < 5000; i++) {
        ASSERT_GE(leaves[i].size(), 1u) << "triangle " << i;
        for (uint32_t k = 0; k < 20; k++) {
            double u = random.uniform();
            double v = random.uniform();
            if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
            const Vector3d a(mesh.positions[3 * i]);
            const Vector3d p =
                a + u * (Vector3d(mesh.positions[3 * i + 1]) - a) + v * (Vector3d(mesh.positions[3 * i + 2]) - a);
            // The point is off the triangle by float64's rounding, of coordinates up to 2.
            const auto holds = [&](const Leaf& leaf) {
                bool all = true;
                for (int axis = 0; axis < 3; axis++)
                    all = all && leaf.lo[axis] <= p[axis] + 1e-15 && p[axis] - 1e-15 <= leaf.hi[axis];
                return all;
            };
            ASSERT_TRUE(std::any_of(leaves[i].begin(), leaves[i].end(), holds)) << "triangle " << i;
        }
    }

    // Candidates that are not opaque come once.
    TriangleGeometry geometry = geometryOf(mesh);
    geometry.opaque = false;
    EXPECT_TRUE(equal(hierarchyOf(geometry, BuildMode::Split), hierarchyOf(geometry, BuildMode::Quality)));
    // Meshes without long triangles are as without splits.
    const Mesh torus = createTorus(1.0f, 0.4f, 40, 20);
    EXPECT_TRUE(equal(hierarchyOf(torus, BuildMode::Split), hierarchyOf(torus, BuildMode::Quality)));
    // A refit would give each piece its triangle's whole box.
    Hierarchy refitted = hierarchyOf(mesh, BuildMode::Split);
    geometry.opaque = true;
    EXPECT_EQ(refitHierarchy(refitted, std::span(&geometry, 1)).error().id(), "tracing.refit");
}

TEST(TracingHierarchy, HoldsItsPrimitivesForAllSizes) {
    for (const auto& [mode, form] : all_kinds) {
        for (const uint32_t count : {0u,  1u,   2u,   3u,   7u,    8u,    9u,    15u,    16u,    17u,    63u,   64u,
                                     65u, 255u, 256u, 257u, 4095u, 4096u, 4097u, 16383u, 16384u, 16385u, 40000u}) {
            SCOPED_TRACE(count);
            const Hierarchy hierarchy = hierarchyOf(soup(count, count), mode, nullptr, form);
            EXPECT_EQ(hierarchy.records, count);
            EXPECT_EQ(hierarchy.inactive, 0u);
            const HierarchyWalk walk(hierarchy);
            // What a triangle takes at the driver of the development machine, and what the root takes besides; for full
            // nodes, three children each: half as many nodes as triangles, of 128 bytes, and 48 of the record.
            const uint64_t each = form == NodeForm::Packed ? 104 : 112;
            EXPECT_LE(hierarchy.bytes(), each * count + 256);
        }
    }
}

TEST(TracingHierarchy, IsTheSameForAnyNumberOfThreads) {
    const Mesh mesh = soup(50000, 1);
    for (const auto& [mode, form] : all_kinds) {
        const Hierarchy one = hierarchyOf(mesh, mode, nullptr, form);
        for (const uint32_t threads : {1u, 2u, 3u, 7u}) {
            ThreadPool pool(threads);
            EXPECT_TRUE(equal(one, hierarchyOf(mesh, mode, &pool, form))) << threads << " threads";
        }
    }
}

TEST(TracingHierarchy, StandsWhatBuildersStumbleOver) {
    Mesh one_place = soup(1, 3);
    for (uint32_t i = 0; i < 5000; i++) {
        for (uint32_t c = 0; c < 3; c++) one_place.indices.push_back(c);
    }
    // Each triangle half as far as the one before: a chain for the surface area heuristic.
    Mesh chain;
    for (int i = 0; i < 240; i++) {
        for (int c = 0; c < 3; c++) {
            chain.indices.push_back(static_cast<uint32_t>(chain.positions.size()));
            const float scale = std::ldexp(1.0f, 120 - i);
            chain.positions.push_back(Vector3f(c == 0 ? 1.0f : 1.1f, c == 1 ? 1.0f : 0.1f, 0.2f) * scale);
        }
    }
    Mesh flat = soup(3000, 4);
    for (Vector3f& p : flat.positions) p.z = 7.0f;
    Mesh line = soup(3000, 5);
    for (Vector3f& p : line.positions) p.y = p.z = -3.0f;
    const std::pair<const char*, Mesh> cases[] = {
        {"one place", one_place},
        {"chain", chain},
        {"plane", flat},
        {"line", line},
        {"1e30", soup(3000, 6, 1e30)},
        {"3e38", soup(3000, 7, 3e38)},
        {"1e-30", soup(3000, 8, 1e-30)},
        {"denormal", soup(3000, 9, 1e-42)},
        {"far away", soup(3000, 10, 1.0, 1e6)},
        {"both signs, huge", soup(3000, 11, 6e38, -3e38)},
    };
    for (const auto& [name, mesh] : cases) {
        SCOPED_TRACE(name);
        for (const auto& [mode, form] : all_kinds) {
            const Hierarchy hierarchy = hierarchyOf(mesh, mode, nullptr, form);
            EXPECT_EQ(hierarchy.records + hierarchy.inactive, mesh.triangleCount());
            const HierarchyWalk walk(hierarchy);
        }
    }
}

TEST(TracingHierarchy, LeavesOutWhatIsNotFinite) {
    Mesh mesh = soup(100, 2);
    mesh.positions[3 * 10].x = nan;
    mesh.positions[3 * 20 + 1].y = infinity;
    mesh.positions[3 * 30 + 2].z = -infinity;
    for (const auto& [mode, form] : all_kinds) {
        const Hierarchy hierarchy = hierarchyOf(mesh, mode, nullptr, form);
        EXPECT_EQ(hierarchy.records, 97u);
        EXPECT_EQ(hierarchy.inactive, 3u);
        const HierarchyWalk walk(hierarchy);
    }
    for (Vector3f& p : mesh.positions) p.x = nan;
    const Hierarchy empty = hierarchyOf(mesh, BuildMode::Quality);
    EXPECT_EQ(empty.records, 0u);
    const HierarchyWalk walk(empty);
}

TEST(TracingHierarchy, TakesSeveralGeometriesAndFormsOfIndices) {
    const Mesh mesh = soup(300, 12);
    std::vector<uint16_t> shorts(mesh.indices.begin(), mesh.indices.begin() + 300);
    struct Vertex {
        Vector3f position;
        float other;
    };
    std::vector<Vertex> spread;
    for (const Vector3f& p : mesh.positions) spread.push_back({p, nan});
    TriangleGeometry geometries[4];
    geometries[0] = geometryOf(mesh);
    geometries[0].opaque = false;
    geometries[1] = geometryOf(mesh);
    geometries[1].indices = reinterpret_cast<const std::byte*>(shorts.data());
    geometries[1].index = TriangleGeometry::Index::Uint16;
    geometries[1].triangles = 100;
    geometries[3].positions = reinterpret_cast<const std::byte*>(spread.data());
    geometries[3].stride = sizeof(Vertex);
    geometries[3].vertices = static_cast<uint32_t>(spread.size());
    geometries[3].triangles = 300;
    const Expected<Hierarchy> hierarchy = buildHierarchy(geometries, BuildMode::Quality);
    ASSERT_TRUE(hierarchy) << hierarchy.error().text();
    EXPECT_EQ(hierarchy->records, 700u);
    const HierarchyWalk walk(*hierarchy);
    std::vector<uint32_t> seen(4 * 300);
    for (uint32_t i = 0; i < hierarchy->records; i++) {
        Record record;
        std::memcpy(&record, &hierarchy->texels[hierarchy->firstRecord() + 3 * size_t(i)], sizeof(record));
        const uint32_t geometry = record.geometry & ~Record::opaque_bit;
        ASSERT_LT(geometry, 4u);
        ASSERT_LT(record.primitive, 300u);
        seen[300 * geometry + record.primitive]++;
        EXPECT_EQ((record.geometry & Record::opaque_bit) != 0, geometry != 0);
        for (uint32_t c = 0; c < 3; c++)
            EXPECT_EQ(std::memcmp(record.values + 3 * c, &mesh.positions[3 * record.primitive + c], 12), 0);
    }
    for (uint32_t i = 0; i < seen.size(); i++) EXPECT_EQ(seen[i], i < 300 ? 1u : i < 400 ? 1u : i < 900 ? 0u : 1u) << i;
}

TEST(TracingHierarchy, BuildsBoxes) {
    Random random(13);
    std::vector<float> boxes;
    for (uint32_t i = 0; i < 1000; i++) {
        float lo[3];
        for (float& x : lo) boxes.push_back(x = static_cast<float>(random.uniform()));
        for (const float x : lo) boxes.push_back(x + static_cast<float>(random.uniform(0.0, 0.1)));
    }
    boxes[6 * 5] = nan;
    boxes[6 * 6 + 3] = boxes[6 * 6] - 1.0f;  // minimum above maximum
    BoxGeometry geometry;
    geometry.boxes = reinterpret_cast<const std::byte*>(boxes.data());
    geometry.count = 1000;
    const Expected<Hierarchy> hierarchy = buildHierarchy(std::span(&geometry, 1), BuildMode::Quality);
    ASSERT_TRUE(hierarchy) << hierarchy.error().text();
    EXPECT_EQ(hierarchy->records, 998u);
    const HierarchyWalk walk(*hierarchy);
}

TEST(TracingHierarchy, ExplainsBadInput) {
    Mesh mesh = soup(10, 14);
    mesh.indices[17] = 30;
    TriangleGeometry geometry = geometryOf(mesh);
    Expected<Hierarchy> hierarchy = buildHierarchy(std::span(&geometry, 1), BuildMode::Quality);
    ASSERT_FALSE(hierarchy);
    EXPECT_EQ(hierarchy.error().id(), "tracing.index_range");
    EXPECT_NE(hierarchy.error().text().find("triangle 5 of geometry 0 has the index 30"), std::string::npos)
        << hierarchy.error().text();
    geometry.index = TriangleGeometry::Index::None;
    geometry.triangles = 11;
    EXPECT_EQ(buildHierarchy(std::span(&geometry, 1), BuildMode::Fast).error().id(), "tracing.vertex_count");
    geometry.triangles = max_primitives + 1;
    EXPECT_EQ(buildHierarchy(std::span(&geometry, 1), BuildMode::Fast).error().id(), "tracing.too_large");
}

TEST(TracingHierarchy, RefitsToTheSameAndToOtherCoordinates) {
    for (const auto& [mode, form] : all_kinds) {
        Mesh mesh = soup(20000, 15);
        const Hierarchy built = hierarchyOf(mesh, mode, nullptr, form);
        Hierarchy refitted = hierarchyOf(mesh, mode, nullptr, form);
        const TriangleGeometry geometry = geometryOf(mesh);
        ASSERT_TRUE(refitHierarchy(refitted, std::span(&geometry, 1)));
        EXPECT_TRUE(equal(built, refitted));

        for (Vector3f& p : mesh.positions) p = Vector3f(3.0f * p.y, p.x + 100.0f, p.z * p.z);
        mesh.positions[77].x = nan;
        for (uint32_t i = 0; i < 3 * 64; i++) mesh.positions[i].y = infinity;
        ThreadPool pool(3);
        ASSERT_TRUE(refitHierarchy(refitted, std::span(&geometry, 1)));
        const HierarchyWalk walk(refitted);
        Hierarchy parallel = hierarchyOf(soup(20000, 15), mode, nullptr, form);
        ASSERT_TRUE(refitHierarchy(parallel, std::span(&geometry, 1), &pool));
        EXPECT_TRUE(equal(refitted, parallel));
    }
    Hierarchy hierarchy = hierarchyOf(soup(10, 16), BuildMode::Fast);
    const Mesh other = soup(11, 17);
    const TriangleGeometry geometry = geometryOf(other);
    EXPECT_EQ(refitHierarchy(hierarchy, std::span(&geometry, 1)).error().id(), "tracing.refit");
    const BoxGeometry boxes;
    EXPECT_EQ(refitHierarchy(hierarchy, std::span(&boxes, 1)).error().id(), "tracing.refit");
}

TEST(TracingHierarchy, QualityIsWorthItsTime) {
    // A small sphere, its triangles in random order, and one more far away: cells of the curve hold the sphere whole,
    // so only the heuristic tells its triangles apart, and less surface means fewer nodes visited.
    Mesh mesh = createSphere(1.0f, 4);
    Random random(18);
    for (size_t i = mesh.triangleCount() - 1; i > 0; i--) {
        const size_t other = random.below(i + 1);
        for (size_t c = 0; c < 3; c++) std::swap(mesh.indices[3 * i + c], mesh.indices[3 * other + c]);
    }
    for (uint32_t c = 0; c < 3; c++) {
        mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
        mesh.positions.push_back(Vector3f(1e4f, c == 1 ? 1.0f : 0.0f, c == 2 ? 1.0f : 0.0f));
    }
    const HierarchyWalk quality(hierarchyOf(mesh, BuildMode::Quality));
    const HierarchyWalk fast(hierarchyOf(mesh, BuildMode::Fast));
    EXPECT_LT(quality.area, 0.5 * fast.area);
}

TEST(TracingHierarchy, LoopsRunEachPieceOnce) {
    ThreadPool pool(3);
    for (const size_t count : {size_t(0), size_t(1), size_t(2), size_t(1000)}) {
        std::vector<std::atomic<int>> calls(count);
        parallelFor(&pool, count, [&](size_t i) {
            calls[i]++;
            // Loops within loops must not wait for one another.
            parallelFor(&pool, 3, [&](size_t) { calls[i]++; });
        });
        for (const auto& each : calls) EXPECT_EQ(each, 4);
    }
}

}  // namespace

}  // namespace glint::test
