// Meshes that are wrong go through everything that is done with meshes: refused with a reason, or done.

#include "support/bad_meshes.h"
#include "support/matchers.h"
#include "support/reference.h"
#include "support/surface_reference.h"

#include <glint/format/mesh_graph.h>
#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/refine.h>
#include <glint/geometry/simplify.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

using namespace glint;
using namespace glint::test;

TEST(BadMeshes, AreValidOrNot) {
    for (const BadMesh& bad : badMeshes()) {
        const Status status = bad.mesh.validate();
        EXPECT_EQ(errorOf(status).id(), bad.invalid) << bad.name << ": " << errorOf(status).text();
    }
}

// What has nothing to refuse with takes whatever has its indices in range.
TEST(BadMeshes, AreWeldedOrderedAndCounted) {
    for (const BadMesh& bad : badMeshes()) {
        if (bad.invalid == "mesh.index_range" || bad.invalid == "mesh.index_count" ||
            bad.invalid == "mesh.attribute_count" || bad.invalid == "mesh.part_range")
            continue;
        SCOPED_TRACE(bad.name);
        for (const bool by_position : {false, true}) {
            Mesh mesh = bad.mesh;
            const MeshWeld taken = by_position ? weldPositions(mesh) : weld(mesh);
            EXPECT_EQ(mesh.triangleCount() + taken.triangles, bad.mesh.triangleCount());
            EXPECT_EQ(mesh.positions.size() + taken.vertices, bad.mesh.positions.size());
            optimize(mesh);
            EXPECT_EQ(mesh.triangleCount() + taken.triangles, bad.mesh.triangleCount());
            EXPECT_EQ(statistics(mesh).triangles, mesh.triangleCount());
            if (!bad.invalid.empty()) continue;
            // The same surface.
            EXPECT_TRUE(boundaryOf(mesh) == boundaryOf(bad.mesh));
            mesh.createNormals();
            for (const Vector3f& normal : mesh.normals) EXPECT_TRUE(isFinite(normal));
        }
    }
}

TEST(BadMeshes, AreRefinedOrRefused) {
    const std::set<std::string> reasons = {"refine.edge_faces", "refine.edge_direction", "refine.vertex_fans"};
    size_t refined = 0, refused = 0;
    for (const BadMesh& bad : badMeshes()) {
        SCOPED_TRACE(bad.name);
        const Expected<PolygonMesh> cage = toPolygons(bad.mesh);
        if (!cage) {
            EXPECT_THAT(cage, HasErrorId(bad.invalid.empty() ? "polygon.no_faces" : bad.invalid));
            continue;
        }
        EXPECT_EQ(bad.invalid, "");
        for (const Subdivision scheme : {Subdivision::CatmullClark, Subdivision::Loop})
            for (const bool to_limit : {false, true}) {
                const Expected<PolygonMesh> fine = to_limit ? toLimit(*cage, scheme, 1) : refine(*cage, scheme, 1);
                if (!fine) {
                    EXPECT_TRUE(reasons.count(std::string(fine.error().id()))) << fine.error().text();
                    refused++;
                    continue;
                }
                const Expected<Mesh> mesh = toTriangles(*fine);
                ASSERT_THAT(mesh, IsOk());
                // Three quadrilaterals of two triangles, or four triangles.
                EXPECT_EQ(mesh->triangleCount(), cage->faceCount() * (scheme == Subdivision::Loop ? 4 : 6));
                EXPECT_THAT(mesh->validate(), IsOk());
                refined++;
            }
    }
    EXPECT_GT(refined, 10u);
    EXPECT_GT(refused, 10u);
}

TEST(BadMeshes, AreSimplifiedOrRefused) {
    for (const BadMesh& bad : badMeshes()) {
        SCOPED_TRACE(bad.name);
        const Expected<SimplifiedMesh> simple = simplify(bad.mesh, {.ratio = 0.2, .max_error = 0.1});
        EXPECT_EQ(errorOf(simple).id(), bad.invalid) << errorOf(simple).text();
        if (!simple) continue;
        EXPECT_LE(simple->mesh.triangleCount(), bad.mesh.triangleCount());
        EXPECT_LE(simple->distance.upper, 0.1);
    }
}

TEST(BadMeshes, HaveLevelsOfDetailOrAreRefused) {
    for (const BadMesh& bad : badMeshes()) {
        SCOPED_TRACE(bad.name);
        // Steps instead of seconds: a few for each group.
        size_t steps = 0;
        MeshGraphOptions options;
        options.progress = [&](float) { return ++steps <= 10 * bad.mesh.triangleCount() + 1000; };
        const Expected<MeshGraph> graph = createMeshGraph(bad.mesh, options);
        EXPECT_EQ(errorOf(graph).id(), bad.no_graph) << errorOf(graph).text();
        if (!graph) continue;
        const size_t finest = graph->mesh(graph->cut(-1.0f)).triangleCount();
        EXPECT_LE(finest, bad.mesh.triangleCount());
        for (const float error : {0.0f, 1e-3f, 1.0f, INFINITY}) {
            const Mesh shown = graph->mesh(graph->cut(error));
            EXPECT_THAT(shown.validate(), IsOk());
            EXPECT_LE(shown.triangleCount(), finest);
        }
        const Expected<MeshGraph> again = MeshGraph::decode(graph->bytes(), bad.name);
        EXPECT_THAT(again, IsOk());
    }
}

// A few bytes that say there are billions of triangles.
TEST(BadMeshes, HeadersThatPromiseBillions) {
    for (const char* count : {"1431655766", "4294967296", "18446744073709551615", "99999999999999999999"}) {
        const std::string text =
            std::string("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
                        "property float y\nproperty float z\nelement face ") +
            count + "\nproperty list uchar uint vertex_indices\nend_header\n" + std::string(36, '\0') +
            std::string(13, '\3');
        const Expected<Mesh> mesh = parsePly(std::as_bytes(std::span(text)), "billions.ply");
        const std::string id(errorOf(mesh).id());
        EXPECT_TRUE(id == "ply.truncated" || id == "ply.header") << errorOf(mesh).text();
    }
    BadMesh one;
    for (BadMesh& bad : badMeshes())
        if (bad.name == "one triangle") one = bad;
    const MeshGraph graph = *createMeshGraph(one.mesh);
    // Each of the counts, one at a time, just above and far above what 32 bits count.
    for (size_t at = 24; at < 104; at += 8)
        for (const uint64_t count : {uint64_t{1} << 32, ~uint64_t{0}, (uint64_t{1} << 60) / 3}) {
            std::vector<std::byte> bytes(graph.bytes().begin(), graph.bytes().end());
            std::memcpy(&bytes[at], &count, 8);
            const Expected<MeshGraph> read = MeshGraph::decode(bytes, "billions.lod");
            EXPECT_THAT(read, HasErrorId("graph.counts"));
        }
}
