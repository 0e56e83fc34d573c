// Orders, simplification, tangents and counts of meshes.

#include "support/matchers.h"
#include "support/reference.h"
#include "support/surface_reference.h"

#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/simplify.h>
#include <glint/geometry/tangents.h>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

using namespace glint;
using namespace glint::test;

namespace {

/// A torus whose triangles and vertices are in random order, in two parts with something between them.
Mesh shuffled() {
    const Mesh torus = createTorus(2.0f, 0.7f, 48, 32);
    Random random(1);
    std::vector<uint32_t> vertices(torus.positions.size()), triangles(torus.triangleCount());
    for (uint32_t i = 0; i < vertices.size(); i++) vertices[i] = i;
    for (uint32_t i = 0; i < triangles.size(); i++) triangles[i] = i;
    const auto shuffle = [&](std::vector<uint32_t>& list) {
        for (size_t i = list.size(); i-- > 1;) std::swap(list[i], list[random.below(i + 1)]);
    };
    shuffle(vertices);
    shuffle(triangles);
    Mesh mesh;
    mesh.positions.resize(vertices.size());
    mesh.normals.resize(vertices.size());
    for (size_t i = 0; i < vertices.size(); i++) {
        mesh.positions[vertices[i]] = torus.positions[i];
        mesh.normals[vertices[i]] = torus.normals[i];
    }
    for (const uint32_t i : triangles)
        for (size_t k = 0; k < 3; k++) mesh.indices.push_back(vertices[torus.indices[i * 3 + k]]);
    mesh.parts = {{"a", 300, 900, 1}, {"b", 1800, 3000, 2}};
    return mesh;
}

using Corner = std::array<float, 6>;

/// The triangles of a run with their attributes, whatever the numbers of their vertices: sorted.
std::multiset<std::array<Corner, 3>> trianglesOf(const Mesh& mesh, size_t first, size_t count) {
    std::multiset<std::array<Corner, 3>> result;
    for (size_t i = first; i < first + count; i += 3) {
        std::array<Corner, 3> corners;
        for (size_t k = 0; k < 3; k++) {
            const Vector3f &p = mesh.positions[mesh.indices[i + k]], &n = mesh.normals[mesh.indices[i + k]];
            corners[k] = {p.x, p.y, p.z, n.x, n.y, n.z};
        }
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        result.insert(corners);
    }
    return result;
}

void expectSameTriangles(const Mesh& a, const Mesh& b) {
    ASSERT_EQ(a.parts, b.parts);
    ASSERT_EQ(a.indices.size(), b.indices.size());
    size_t end = 0;
    for (const MeshPart& part : a.parts) {
        EXPECT_TRUE(trianglesOf(a, end, part.first_index - end) == trianglesOf(b, end, part.first_index - end));
        EXPECT_TRUE(trianglesOf(a, part.first_index, part.index_count) ==
                    trianglesOf(b, part.first_index, part.index_count));
        end = part.first_index + part.index_count;
    }
    EXPECT_TRUE(trianglesOf(a, end, a.indices.size() - end) == trianglesOf(b, end, a.indices.size() - end));
}

}  // namespace

TEST(MeshOptimize, KeepsTrianglesAndHelps) {
    const Mesh before = shuffled();
    const MeshOrderStatistics bad = orderStatistics(before);
    Mesh mesh = before;
    for (const auto& step : {optimizeVertexCache, +[](Mesh& m) { optimizeOverdraw(m); }, optimizeVertexFetch}) {
        step(mesh);
        EXPECT_THAT(mesh.validate(), IsOk());
        expectSameTriangles(before, mesh);
    }
    Mesh again = before;
    optimize(again);
    EXPECT_EQ(again, mesh);
    // In one piece: triangles of a part that lie all over the mesh share few vertices.
    Mesh whole = before;
    whole.parts.clear();
    optimize(whole);
    const MeshOrderStatistics good = orderStatistics(whole);
    // Nothing can be below half a vertex for a triangle; shuffled ones have nearly three.
    EXPECT_GT(bad.acmr, 2.5);
    EXPECT_LT(good.acmr, 0.8);
    EXPECT_GE(good.acmr, 0.5);
    EXPECT_LT(good.atvr, bad.atvr);
    EXPECT_GE(good.atvr, 1.0);
    EXPECT_LE(good.overfetch, bad.overfetch);
    EXPECT_GE(good.overdraw, 1.0);
    EXPECT_NEAR(good.atvr, good.acmr * 2, 0.01);  // a torus has twice as many triangles as vertices
}

TEST(MeshOptimize, WeldDropsWhatIsNotNeeded) {
    Mesh mesh = shuffled();
    const Mesh before = mesh;
    // Each triangle with vertices of its own, two degenerate ones, vertices that nobody uses.
    Mesh split;
    split.parts = mesh.parts;
    for (const uint32_t index : mesh.indices) {
        split.indices.push_back(static_cast<uint32_t>(split.positions.size()));
        split.positions.push_back(mesh.positions[index]);
        split.normals.push_back(mesh.normals[index]);
    }
    split.positions.emplace_back(9, 9, 9);
    split.normals.emplace_back(0, 0, 1);
    split.indices.insert(split.indices.end(), {0, 0, 1, 7, 9, 9});
    const size_t vertices = split.positions.size();
    const MeshWeld taken = weld(split);
    EXPECT_EQ(taken.triangles, 2u);
    EXPECT_EQ(taken.vertices, vertices - before.positions.size());
    EXPECT_EQ(split.positions.size(), before.positions.size());
    expectSameTriangles(before, split);

    // Degenerate ones within parts: the parts shrink.
    Mesh parts = before;
    for (const size_t i : {300u, 303u, 1197u, 1797u, 4797u}) parts.indices[i + 1] = parts.indices[i];
    EXPECT_EQ(weld(parts).triangles, 5u);
    EXPECT_THAT(parts.validate(), IsOk());
    EXPECT_EQ(parts.parts[0].first_index, 300u);
    EXPECT_EQ(parts.parts[0].index_count, 891u);
    EXPECT_EQ(parts.parts[1].first_index, 1788u);
    EXPECT_EQ(parts.parts[1].index_count, 2997u);

    Mesh box = createBox({1, 1, 1});
    EXPECT_EQ(weldPositions(box).vertices, 16u);
    EXPECT_TRUE(box.normals.empty() && box.texcoords.empty());
    Mesh point;
    point.positions = {{0, 0, 0}, {-0.0f, 0, 0}, {0, 0, 0}};
    point.indices = {0, 1, 2};
    EXPECT_EQ(weld(point).triangles, 1u);
    EXPECT_TRUE(point.positions.empty());
}

TEST(MeshOptimize, CountsWhatIsThere) {
    const MeshStatistics box = statistics(createBox({1, 2, 3}));
    EXPECT_EQ(box.edges, 18u);
    EXPECT_EQ(box.repeated_vertices, 16u);
    EXPECT_EQ(box.components, 1u);
    EXPECT_TRUE(box.isClosed());
    EXPECT_NEAR(box.area, 22.0, 1e-6);
    EXPECT_NEAR(box.volume, 6.0, 1e-6);

    Mesh bad = createPlane(2.0f, 1);
    EXPECT_EQ(statistics(bad).open_edges, 4u);
    bad.positions.insert(bad.positions.end(), {{5, 5, 5}, {0, 0, 1}, {0, 0, 2}, {0, 0, 3}});
    const uint32_t a = bad.indices[0], b = bad.indices[1], c = bad.indices[2];
    // A turned copy, a degenerate one, one without area by itself, one on an edge that has two.
    bad.indices.insert(bad.indices.end(), {b, a, c, a, a, b, 5, 6, 7, a, b, 6});
    const MeshStatistics s = statistics(bad);
    EXPECT_EQ(s.triangles, 6u);
    EXPECT_EQ(s.unused_vertices, 1u);
    EXPECT_EQ(s.degenerate_triangles, 1u);
    EXPECT_EQ(s.flat_triangles, 1u);
    EXPECT_EQ(s.repeated_triangles, 1u);
    EXPECT_EQ(s.components, 2u);  // the one without area hangs on nothing
    EXPECT_GE(s.non_manifold_edges, 1u);
    EXPECT_FALSE(s.isClosed());
    Mesh turned = createPlane(2.0f, 1);
    std::swap(turned.indices[0], turned.indices[1]);
    EXPECT_EQ(statistics(turned).turned_edges, 1u);
    EXPECT_EQ(statistics(Mesh()).edges, 0u);
    EXPECT_FALSE(statistics(Mesh()).isClosed());
}

TEST(Simplify, StaysWithinTheError) {
    Mesh mesh = createTorus(2.0f, 0.7f, 36, 24);
    const NearestReference to_mesh(mesh);
    size_t last = SIZE_MAX;
    for (const double error : {0.0005, 0.005, 0.05}) {
        const Expected<SimplifiedMesh> simple = simplify(mesh, {.ratio = 0.0, .max_error = error});
        ASSERT_THAT(simple, IsOk());
        EXPECT_LE(simple->distance.upper, error);
        EXPECT_LT(simple->mesh.triangleCount(), last);
        EXPECT_TRUE(isClosed(simple->mesh));
        last = simple->mesh.triangleCount();
        double distance = 0.0;
        const NearestReference to_simple(simple->mesh);
        for (const Vector3d& p : samplePoints(simple->mesh, 0.1)) distance = std::max(distance, to_mesh.distance(p));
        for (const Vector3f& p : mesh.positions) distance = std::max(distance, to_simple.distance(Vector3d(p)));
        EXPECT_LE(distance, simple->distance.upper + 1e-15);  // the reference's rounding
    }
    EXPECT_LT(last, mesh.triangleCount() / 3);
    EXPECT_NEAR(simplify(mesh, {.ratio = 0.25})->mesh.triangleCount(), mesh.triangleCount() / 4, 4);
    EXPECT_EQ(simplify(mesh, {.ratio = 1.0})->distance.lower, 0.0);
    // A part's border stays, so that the parts fit each other.
    mesh.parts = {{"a", 0, 2400, 1}, {"b", 2400, static_cast<uint32_t>(mesh.indices.size()) - 2400, 2}};
    const SimplifiedMesh parts = *simplify(mesh, {.ratio = 0.3});
    EXPECT_TRUE(isClosed(parts.mesh));
    EXPECT_THAT(parts.mesh.validate(), IsOk());
    EXPECT_LT(parts.mesh.triangleCount(), mesh.triangleCount() / 2);
    const Mesh plane = createPlane(1.0f, 20);
    EXPECT_TRUE(boundaryOf(simplify(plane, {.ratio = 0.1, .keep_border = true})->mesh) == boundaryOf(plane));

    EXPECT_THAT(simplify(mesh, {.ratio = 1.5}), HasErrorId("simplify.options"));
    EXPECT_THAT(simplify(mesh, {.ratio = NAN}), HasErrorId("simplify.options"));
    EXPECT_THAT(simplify(mesh, {.ratio = 0.5, .max_error = -1.0}), HasErrorId("simplify.options"));
    EXPECT_THAT(simplify(Mesh()), HasErrorId("mesh.no_faces"));
}

// Texture coordinates that are a linear function of the place have one tangent, known beforehand.
TEST(Tangents, AreThoseOfTheTexture) {
    Mesh mesh = createSphere(1.0f, 3);
    const Vector3d u = glm::normalize(Vector3d(1, 2, -1)), v = Vector3d(0.3, 0.1, 0.8);
    for (const Vector3f& p : mesh.positions)
        mesh.texcoords.emplace_back(glm::dot(Vector3d(p), u), glm::dot(Vector3d(p), v));
    const Mesh before = mesh;
    const Expected<std::vector<Vector4f>> tangents = createTangents(mesh);
    ASSERT_THAT(tangents, IsOk());
    ASSERT_EQ(tangents->size(), mesh.positions.size());
    EXPECT_GT(mesh.positions.size(), before.positions.size()) << "the back of the texture is mirrored";
    EXPECT_EQ(mesh.indices.size(), before.indices.size());
    size_t compared = 0;
    for (size_t i = 0; i < tangents->size(); i++) {
        const Vector3d t(Vector3f((*tangents)[i])), n = glm::normalize(Vector3d(mesh.normals[i]));
        EXPECT_NEAR(glm::length(t), 1.0, 1e-6);
        EXPECT_NEAR(glm::dot(t, n), 0.0, 1e-6);
        // On the sphere's tangent plane, the direction in which u grows while v stays: at a right angle to v's
        // gradient.
        const Vector3d gradient_v = v - n * glm::dot(v, n);
        Vector3d expected = glm::cross(gradient_v, n);
        if (glm::length(expected) < 0.3) continue;
        expected = glm::normalize(expected);
        if (glm::dot(expected, u) < 0) expected = -expected;
        if (std::abs(glm::dot(expected, u)) < 0.3) continue;  // the texture has nearly no area here
        compared++;
        // Triangles with edges of 0.16 differ from the sphere by half of that, as an angle; their mean by less.
        EXPECT_GT(glm::dot(t, expected), std::cos(0.16)) << i;
        const double w = glm::dot(glm::cross(n, t) * double{(*tangents)[i].w}, gradient_v);
        EXPECT_GT(w, 0.0) << "the bitangent points to where v grows";
    }
    EXPECT_GT(compared, tangents->size() / 2);
    for (size_t i = 0; i < mesh.indices.size(); i++) {
        EXPECT_EQ(mesh.positions[mesh.indices[i]], before.positions[before.indices[i]]);
        EXPECT_EQ(mesh.texcoords[mesh.indices[i]], before.texcoords[before.indices[i]]);
    }
    Mesh again = before;
    EXPECT_EQ(*createTangents(again), *tangents);
}

// The library that finds shared vertices takes whole triangles only, and says so by ending the program.
TEST(Tangents, OfAnyNumberOfVertices) {
    for (uint32_t segments = 1; segments < 6; segments++) {
        Mesh mesh = createPlane(1.0f, segments);
        const size_t vertices = mesh.positions.size();
        ASSERT_THAT(createTangents(mesh), IsOk()) << vertices;
        EXPECT_EQ(mesh.positions.size(), vertices);
    }
}

// A square in z = 0, its right half mirrored in the texture, so that the vertices in the middle are split.
TEST(Tangents, OfAPrimitive) {
    ScenePrimitive primitive;
    for (int x = 0; x < 3; x++)
        for (int y = 0; y < 2; y++) {
            primitive.positions.emplace_back(x, y, 0);
            primitive.normals.emplace_back(0, 0, 1);
            // v goes down the picture.
            primitive.texcoords[0].emplace_back(7, 7);
            primitive.texcoords[1].emplace_back(x == 1 ? 1 : 0, 1 - y);
            primitive.colors.emplace_back(x, y, 0, 1);
            primitive.joints.push_back({static_cast<uint16_t>(x), 0, 0, 0});
            primitive.weights.emplace_back(1, 0, 0, 0);
        }
    primitive.targets = {{primitive.positions, primitive.normals, primitive.positions}, {}};
    primitive.indices = {0, 2, 3, 0, 3, 1, 2, 4, 5, 2, 5, 3};
    const ScenePrimitive before = primitive;
    ASSERT_THAT(createTangents(primitive, 1), IsOk());
    EXPECT_THAT(primitive.validate(), IsOk());
    ASSERT_EQ(primitive.positions.size(), 8u);
    for (size_t i = 0; i < primitive.indices.size(); i++) {
        const uint32_t now = primitive.indices[i], then = before.indices[i];
        EXPECT_EQ(primitive.positions[now], before.positions[then]);
        EXPECT_EQ(primitive.texcoords[1][now], before.texcoords[1][then]);
        EXPECT_EQ(primitive.colors[now], before.colors[then]);
        EXPECT_EQ(primitive.joints[now], before.joints[then]);
        EXPECT_EQ(primitive.targets[0].tangents[now], before.targets[0].tangents[then]);
        // u grows to the right on the left, and v shrinks upward: the bitangent w * (z x t) is +Y on both sides.
        const bool is_right = i >= 6;
        EXPECT_EQ(primitive.tangents[now], Vector4f(is_right ? -1 : 1, 0, 0, is_right ? -1 : 1)) << i;
    }
    ScenePrimitive again = before;
    EXPECT_THAT(createTangents(again, 2), HasErrorId("mesh.attribute_count")) << "there is no third set";
    again.joints.pop_back();
    EXPECT_THAT(createTangents(again), HasErrorId("scene.attribute_count"));
}

TEST(Tangents, WithoutATexture) {
    Mesh mesh = createPlane(1.0f, 2);
    std::fill(mesh.texcoords.begin(), mesh.texcoords.end(), Vector2f(0.5f));
    const Expected<std::vector<Vector4f>> tangents = createTangents(mesh);
    ASSERT_THAT(tangents, IsOk());
    for (const Vector4f& t : *tangents) {
        EXPECT_NEAR(glm::length(Vector3f(t)), 1.0, 1e-6);
        EXPECT_EQ(t.z, 0.0f);
        EXPECT_EQ(t.w, 1.0f);
    }
    mesh.texcoords.clear();
    EXPECT_THAT(createTangents(mesh), HasErrorId("mesh.attribute_count"));
    EXPECT_THAT(createTangents(*std::make_unique<Mesh>()), HasErrorId("mesh.no_faces"));
}
