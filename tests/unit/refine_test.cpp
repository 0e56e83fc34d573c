#include "cages.h"

#include <glm/geometric.hpp>

using namespace glint;
using namespace glint::test;

// The torus of the tutorials: 176 quadrilaterals, four steps, 90,112 triangles.
TEST(Refine, TutorialTorus) {
    const PolygonMesh cage = createTorusQuads(1.07208f, 0.77792f, 16, 11);
    EXPECT_THAT(cage.validate(), IsOk());
    EXPECT_EQ(cage.positions.size(), 176u);
    EXPECT_EQ(cage.faceCount(), 176u);
    const BoundBox box(cage.positions);
    for (int axis = 0; axis < 3; axis++) {
        EXPECT_NEAR(box.max[axis], axis < 2 ? 1.85f : 0.77f, 1e-5f);
        EXPECT_NEAR(box.min[axis], axis < 2 ? -1.85f : -0.77f, 1e-5f);
    }
    const Expected<PolygonMesh> fine = refine(cage, catmull_clark, 4);
    ASSERT_THAT(fine, IsOk());
    EXPECT_EQ(fine->faceCount(), 45056u);
    EXPECT_EQ(fine->positions.size(), 45056u);
    EXPECT_EQ(eulerCharacteristic(*fine), 0);
    const Expected<Mesh> mesh = toTriangles(*fine);
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->triangleCount(), 90112u);
    EXPECT_TRUE(isClosed(*mesh));
    EXPECT_GT(volumeOf(*mesh), 0.0);
    EXPECT_EQ(*refine(cage, catmull_clark, 4), *fine) << "two runs differ";
}

TEST(Refine, CountsAndTopologyAreThoseOfTheScheme) {
    for (const CageCase& c : cageCases()) {
        SCOPED_TRACE(c.name);
        const size_t corners = c.cage.indices.size(), edges = edgesOf(c.cage).size();
        for (const uint32_t steps : {0u, 1u, 2u, 3u}) {
            const Expected<PolygonMesh> fine = refine(c.cage, c.scheme, steps);
            ASSERT_THAT(fine, IsOk());
            EXPECT_THAT(fine->validate(), IsOk());
            if (steps == 0) {
                EXPECT_EQ(fine->positions, c.cage.positions);
                EXPECT_EQ(fine->indices, c.cage.indices);
                continue;
            }
            const size_t quads = corners << (2 * (steps - 1)), cut = c.cage.faceCount() << (2 * steps);
            EXPECT_EQ(fine->faceCount(), c.scheme == catmull_clark ? quads : cut);
            EXPECT_EQ(fine->indices.size(), fine->faceCount() * (c.scheme == catmull_clark ? 4 : 3));
            EXPECT_EQ(eulerCharacteristic(*fine), eulerCharacteristic(c.cage));
            EXPECT_EQ(isClosedPolygons(*fine), c.closed);
            if (steps > 1) continue;
            EXPECT_EQ(fine->positions.size(),
                      c.cage.positions.size() + edges + (c.scheme == catmull_clark ? c.cage.faceCount() : 0));
        }
    }
    const auto volume = [](const PolygonMesh& mesh) { return volumeOf(*toTriangles(mesh)); };
    EXPECT_GT(volume(*refine(cube(), catmull_clark, 3)), 1.0);
    EXPECT_GT(volume(*refine(triangles(cube()), loop, 3)), 1.0);
}

TEST(Refine, MatchesTheRulesInFloat64) {
    std::vector<CageCase> all = cageCases();
    const size_t count = all.size();
    for (size_t i = 0; i < count; i++) {
        CageCase semi = all[i];
        semi.cage.creases.clear();
        crease(semi.cage, 100 + i, 0.5, 0.0f);
        all.push_back(semi);
    }
    for (const CageCase& c : all) {
        SCOPED_TRACE(std::string(c.name) + (c.scheme == loop ? ", Loop" : ", Catmull-Clark"));
        ReferenceSurface reference(c.cage);
        for (int step = 0; step < 3; step++) reference = subdivide(reference, c.scheme);
        const PolygonMesh fine = *refine(c.cage, c.scheme, 3);
        ASSERT_EQ(fine.positions.size(), reference.points.size());
        ASSERT_EQ(fine.faceCount(), reference.faces.size());
        // Vertices are numbered in another way, faces are not.
        for (size_t face = 0; face < reference.faces.size(); face++)
            for (size_t k = 0; k < reference.faces[face].size(); k++) {
                const Vector3d expected = reference.points[reference.faces[face][k]];
                const Vector3d difference = Vector3d(fine.positions[fine.indices[fine.offsets[face] + k]]) - expected;
                const double bound = roundingOf(expected, largestOf(c.cage));
                for (int axis = 0; axis < 3; axis++)
                    ASSERT_LE(std::abs(difference[axis]), bound) << "face " << face << ", corner " << k;
            }
        std::map<std::pair<uint32_t, uint32_t>, int> sides;
        for (const auto& face : reference.faces)
            for (size_t k = 0; k < face.size(); k++) sides[std::minmax(face[k], face[(k + 1) % face.size()])]++;
        size_t sharp = 0;
        for (const auto& [edge, sharpness] : reference.sharpness) sharp += sharpness > 0.0 && sides[edge] == 2;
        EXPECT_EQ(fine.creases.size(), sharp);
    }
}

TEST(Refine, StepsMayBeTakenOneByOne) {
    PolygonMesh cage = prism(5, true);
    crease(cage, 3, 0.5, 0.0f);
    const PolygonMesh whole = *refine(cage, catmull_clark, 3);
    PolygonMesh parts = cage;
    for (int step = 0; step < 3; step++) parts = *refine(parts, catmull_clark, 1);
    ASSERT_EQ(parts.positions.size(), whole.positions.size());
    // Rules are means: rounding to float32 between the steps adds half a unit each.
    std::vector<Vector3f> a = whole.positions, b = parts.positions;
    ReferenceSurface left(whole), right(parts);
    for (size_t face = 0; face < left.faces.size(); face++)
        for (size_t k = 0; k < 4; k++)
            for (int axis = 0; axis < 3; axis++)
                EXPECT_NEAR(left.points[left.faces[face][k]][axis], right.points[right.faces[face][k]][axis],
                            3 * 0x1p-24 * 1.5);
    EXPECT_EQ(parts.creases.size(), whole.creases.size());
}

// An edge of infinite sharpness stays a B-spline, or straight between corners.
TEST(Refine, ACreasedCubeStaysACube) {
    PolygonMesh cage = cube();
    crease(cage, 1, 1.0, infinity);
    for (const PolygonMesh& mesh : {*refine(cage, catmull_clark, 3), *toLimit(cage, catmull_clark, 3)}) {
        for (const Vector3f& p : mesh.positions)
            EXPECT_EQ(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 1.0f);
        EXPECT_EQ(mesh.creases.size(), 12u * 8u);
        EXPECT_NEAR(volumeOf(*toTriangles(mesh)), 8.0, 1e-5);
    }
    const PolygonMesh limit = *toLimit(cage, catmull_clark, 2);
    const PolygonAttribute* normals = limit.attribute("normal");
    ASSERT_TRUE(normals);
    // Each face of the cube has its own normals, along an axis.
    for (size_t corner = 0; corner < limit.indices.size(); corner++) {
        const float* n = &normals->values[3 * normals->indices[corner]];
        const size_t face = corner / 4 / 16;  // 16 quadrilaterals for each of the cube's
        const Vector3f expected =
            std::array<Vector3f, 6>{Vector3f(0, 0, -1), {0, 0, 1}, {0, -1, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}[face];
        EXPECT_NEAR(glm::dot(Vector3f(n[0], n[1], n[2]), expected), 1.0f, 1e-6f) << face;
    }
}

// The sharper, the nearer to the cage's edge; sharpness 0 is no crease.
TEST(Refine, SharpnessIsContinuous) {
    const PolygonMesh smooth = *refine(cube(), catmull_clark, 4);
    double last = 0.0;
    for (const float sharpness : {0.0f, 1e-6f, 0.25f, 0.5f, 0.999999f, 1.0f, 1.000001f, 1.5f, 2.0f, 3.0f, 10.0f}) {
        PolygonMesh cage = cube();
        crease(cage, 1, 1.0, 1.0f);
        for (PolygonCrease& c : cage.creases) c.sharpness = sharpness;
        const PolygonMesh fine = *refine(cage, catmull_clark, 4);
        const double volume = volumeOf(*toTriangles(fine));
        if (sharpness == 0.0f) {
            EXPECT_EQ(fine.positions, smooth.positions);
        } else {
            EXPECT_GT(volume, last - 1e-6) << sharpness;
        }
        if (sharpness == 1e-6f || sharpness == 1.0f || sharpness == 1.000001f) {
            EXPECT_NEAR(volume, last, 1e-4) << sharpness;
        }
        last = volume;
    }
    EXPECT_NEAR(last, 8.0, 1e-5);
}

// ------------------------------------------------------------------------------------------------------- attributes

TEST(Refine, AttributesWithoutSeamsGoWhereThePositionsGo) {
    for (CageCase& c : std::vector<CageCase>(cageCases())) {
        SCOPED_TRACE(c.name);
        PolygonAttribute copy{.name = "copy", .components = 3, .values = {}, .indices = c.cage.indices};
        for (const Vector3f& p : c.cage.positions) copy.values.insert(copy.values.end(), {p.x, p.y, p.z});
        c.cage.attributes.push_back(copy);
        for (const PolygonMesh& mesh : {*refine(c.cage, c.scheme, 2), *toLimit(c.cage, c.scheme, 1)}) {
            const PolygonAttribute& made = *mesh.attribute("copy");
            for (size_t corner = 0; corner < mesh.indices.size(); corner++) {
                const float* value = &made.values[3 * made.indices[corner]];
                ASSERT_EQ(Vector3f(value[0], value[1], value[2]), mesh.positions[mesh.indices[corner]]);
            }
        }
    }
}

// Each face of the cube has the unit square of its own: all edges are seams, so inside each face the coordinates are
// bilinear. Four values that all faces share are as good as 24: a value is one vertex'.
TEST(Refine, AttributesAreLinearAlongSeams) {
    PolygonMesh cage = cube(), shared = cube();
    cage.attributes.push_back({.name = "texcoord", .components = 2, .values = {}, .indices = {}});
    shared.attributes.push_back(
        {.name = "texcoord", .components = 2, .values = {0, 0, 1, 0, 1, 1, 0, 1, 9, 9}, .indices = {}});
    for (uint32_t i = 0; i < 24; i++) {
        shared.attributes[0].indices.push_back(i % 4);
        cage.attributes[0].indices.push_back(i);
        for (size_t k = 0; k < 2; k++) cage.attributes[0].values.push_back(shared.attributes[0].values[i % 4 * 2 + k]);
    }
    const PolygonMesh from_shared = *refine(shared, catmull_clark, 3);
    for (const PolygonMesh& fine : {*refine(cage, catmull_clark, 3), *toLimit(cage, catmull_clark, 3)}) {
        const PolygonAttribute& texcoords = *fine.attribute("texcoord");
        const PolygonAttribute& others = *from_shared.attribute("texcoord");
        EXPECT_THAT(fine.validate(), IsOk());
        EXPECT_EQ(texcoords.values.size() / 2, 6u * 81u);
        for (size_t corner = 0; corner < fine.indices.size(); corner++)
            for (size_t k = 0; k < 2; k++)
                ASSERT_EQ(texcoords.values[2 * texcoords.indices[corner] + k],
                          others.values[2 * others.indices[corner] + k]);
        double area = 0.0;
        for (size_t face = 0; face < fine.faceCount(); face++) {
            const auto at = [&](size_t k) {
                const float* value = &texcoords.values[2 * texcoords.indices[4 * face + k]];
                return Vector2d(value[0], value[1]);
            };
            const Vector2d a = at(2) - at(0), b = at(3) - at(1);
            area += (a.x * b.y - a.y * b.x) / 2;
        }
        EXPECT_NEAR(area, 6.0, 1e-5);
        for (size_t i = 0; i < texcoords.values.size(); i += 2) {
            const double u = texcoords.values[i], v = texcoords.values[i + 1];
            EXPECT_GE(std::min(u, v), 0.0);
            EXPECT_LE(std::max(u, v), 1.0);
            if (u == 0.0 || u == 1.0) { EXPECT_EQ(v * 8, std::round(v * 8)); }
        }
        // A seam parts vertices of the mesh.
        const Mesh mesh = *toTriangles(fine);
        EXPECT_GE(mesh.positions.size(), 6u * 81u);
        EXPECT_EQ(mesh.texcoords.size(), mesh.positions.size());
        EXPECT_TRUE(isClosed(mesh));
    }
}

// A seam that ends inside: its last vertex keeps its value, the one edge next to it is smooth.
TEST(Refine, ASeamMayEndInside) {
    PolygonMesh cage = grid(3, 3, 0.0f);
    PolygonAttribute uv{
        .name = "uv", .components = 1, .values = {0, 1, 2, 3, 10, 5, 6, 7, 8, 100}, .indices = cage.indices};
    // The vertex in the middle of the bottom row has another value in the face to its right.
    for (size_t corner = 4; corner < 8; corner++)
        if (uv.indices[corner] == 1) uv.indices[corner] = 9;
    cage.attributes = {uv};
    const PolygonMesh fine = *refine(cage, catmull_clark, 1);
    std::set<float> values(fine.attributes[0].values.begin(), fine.attributes[0].values.end());
    for (const float kept : {1.0f, 100.0f, 10.0f}) EXPECT_TRUE(values.count(kept)) << kept;
    EXPECT_TRUE(values.count((1.0f + 10.0f) / 2) && values.count((100.0f + 10.0f) / 2));
    EXPECT_EQ(fine.attributes[0].values.size(), 10u + 13u + 4u);  // values, edges and one seam, faces
}

// ------------------------------------------------------------------------------------------------- conversions, errors

TEST(Polygons, FromAndToTriangles) {
    const Mesh box = createBox({1, 2, 3});
    const PolygonMesh welded = *toPolygons(box);
    EXPECT_EQ(welded.positions.size(), 8u);
    EXPECT_EQ(welded.faceCount(), 12u);
    const Mesh back = *toTriangles(welded);
    ASSERT_EQ(back.indices.size(), box.indices.size());
    for (size_t i = 0; i < box.indices.size(); i++) {
        EXPECT_EQ(back.positions[back.indices[i]], box.positions[box.indices[i]]);
        EXPECT_EQ(back.texcoords[back.indices[i]], box.texcoords[box.indices[i]]);
    }
    EXPECT_TRUE(back.normals.empty());
    EXPECT_TRUE(isClosed(back));
    EXPECT_NEAR(volumeOf(back), 6.0, 1e-6);

    Mesh flat;
    flat.positions = {{0, 0, 0}, {-0.0f, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    flat.indices = {0, 1, 2};
    EXPECT_THAT(toPolygons(flat), HasErrorId("polygon.no_faces"));
    flat.indices = {0, 1, 2, 1, 2, 3};
    EXPECT_EQ(toPolygons(flat)->faceCount(), 1u);
    flat.indices[0] = 4;
    EXPECT_THAT(toPolygons(flat), HasErrorId("mesh.index_range"));

    // The shorter diagonal; ties from the first corner; polygons from the first corner.
    const PolygonMesh kite = makeMesh({{-2, 0, 0}, {0, -1, 0}, {2, 0, 0}, {0, 1, 0}}, {{0, 1, 2, 3}});
    EXPECT_EQ(toTriangles(kite)->indices, (std::vector<uint32_t>{0, 1, 3, 1, 2, 3}));
    const PolygonMesh square = makeMesh({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2, 3}});
    EXPECT_EQ(toTriangles(square)->indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(toTriangles(prism(5, false))->triangleCount(), 5u * 2u + 2u * 3u);

    const PolygonMesh limit = *toLimit(createTorusQuads(1.07208f, 0.77792f, 16, 11), catmull_clark, 2);
    const Mesh mesh = *toTriangles(limit);
    EXPECT_EQ(mesh.positions.size(), limit.positions.size());
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vector3f& a = mesh.positions[mesh.indices[i]];
        const Vector3f face =
            glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
        EXPECT_GT(glm::dot(glm::normalize(face), mesh.normals[mesh.indices[i]]), 0.8f);
    }
    PolygonMesh wrong = limit;
    wrong.attributes[0].name = "texcoord";
    EXPECT_THAT(toTriangles(wrong), HasErrorId("polygon.attribute_count"));
}

TEST(Polygons, MalformedOnesAreRefused) {
    const auto broken = [](auto&& change) {
        PolygonMesh mesh = cube();
        mesh.attributes.push_back(
            {.name = "a", .components = 2, .values = std::vector<float>(16), .indices = mesh.indices});
        EXPECT_THAT(mesh.validate(), IsOk());
        change(mesh);
        EXPECT_FALSE(mesh.validate());
        EXPECT_FALSE(toTriangles(mesh));
        EXPECT_FALSE(toLimit(mesh, catmull_clark));
        return refine(mesh, catmull_clark, 1);
    };
    const auto id = [](const char* text) { return HasErrorId(text); };
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets.clear(); }), id("polygon.no_faces"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets = {0}; }), id("polygon.no_faces"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets[0] = 1; }), id("polygon.offsets"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets.back() = 23; }), id("polygon.offsets"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.indices.push_back(0); }), id("polygon.offsets"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets[2] = 3; }), id("polygon.offsets"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets[2] = UINT32_MAX; }), id("polygon.offsets"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets[2] = 6; }), id("polygon.face_corners"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.offsets[2] = 4; }), id("polygon.face_corners"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.indices[5] = 8; }), id("polygon.index_range"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.indices[5] = UINT32_MAX; }), id("polygon.index_range"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.indices[5] = m.indices[7]; }), id("polygon.repeated_vertex"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.positions[3].y = NAN; }), id("polygon.not_finite"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.positions[3].z = infinity; }), id("polygon.not_finite"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.attributes[0].values[3] = -infinity; }), id("polygon.not_finite"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.attributes[0].components = 0; }), id("polygon.attribute_count"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.attributes[0].values.pop_back(); }), id("polygon.attribute_count"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.attributes[0].indices.pop_back(); }), id("polygon.attribute_count"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.attributes[0].indices[2] = 8; }), id("polygon.attribute_range"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.creases = {{0, 8, 1}}; }), id("polygon.crease"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.creases = {{UINT32_MAX, 0, 1}}; }), id("polygon.crease"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.creases = {{0, 1, -1}}; }), id("polygon.crease"));
    EXPECT_THAT(broken([](PolygonMesh& m) { m.creases = {{0, 1, NAN}}; }), id("polygon.crease"));
}

TEST(Refine, WhatIsNoSurfaceIsRefused) {
    PolygonMesh mesh = cube();
    mesh.creases = {{0, 6, 1}};
    EXPECT_THAT(refine(mesh, catmull_clark, 1), HasErrorId("refine.crease_edge"));
    mesh.creases = {{0, 0, 1}};
    EXPECT_THAT(refine(mesh, catmull_clark, 1), HasErrorId("refine.crease_edge"));

    std::vector<Vector3f> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {1, 1, 1}, {2, 1, 1}};
    const PolygonMesh three = makeMesh(points, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
    EXPECT_THAT(refine(three, loop, 1), HasErrorId("refine.edge_faces"));
    EXPECT_NE(refine(three, loop, 1).error().message().find("from vertex 0 to vertex 1"), std::string::npos);
    const PolygonMesh flipped = makeMesh(points, {{0, 1, 2}, {0, 1, 3}});
    EXPECT_THAT(refine(flipped, loop, 1), HasErrorId("refine.edge_direction"));
    const PolygonMesh twice = makeMesh(points, {{0, 1, 2}, {0, 1, 2}});
    EXPECT_THAT(refine(twice, catmull_clark, 1), HasErrorId("refine.edge_direction"));
    const PolygonMesh bow = makeMesh(points, {{0, 1, 2}, {0, 5, 6}});
    EXPECT_THAT(refine(bow, catmull_clark, 1), HasErrorId("refine.vertex_fans"));
    PolygonMesh tips = prism(4, true);  // a second one whose lower tip is the first one's upper tip
    const PolygonMesh other = prism(4, true);
    const auto shift = static_cast<uint32_t>(tips.positions.size());
    for (size_t face = 0; face < other.faceCount(); face++) {
        for (uint32_t c = other.offsets[face]; c < other.offsets[face + 1]; c++)
            tips.indices.push_back(other.indices[c] == 8 ? 9 : other.indices[c] + shift);
        tips.offsets.push_back(static_cast<uint32_t>(tips.indices.size()));
    }
    tips.positions.insert(tips.positions.end(), other.positions.begin(), other.positions.end());
    EXPECT_THAT(refine(tips, catmull_clark, 1), HasErrorId("refine.vertex_fans"));

    EXPECT_THAT(refine(cube(), loop, 1), HasErrorId("refine.not_triangles"));
    EXPECT_THAT(refine(cube(), catmull_clark, 14), HasErrorId("refine.too_large"));
    EXPECT_THAT(refine(cube(), catmull_clark, UINT32_MAX), HasErrorId("refine.too_large"));
    EXPECT_THAT(refine(cube(), catmull_clark, 5, 100'000), HasErrorId("refine.too_large"));
    EXPECT_THAT(toLimit(cube(), catmull_clark, 14), HasErrorId("refine.too_large"));
}

TEST(Refine, VerticesWithoutFacesStay) {
    PolygonMesh mesh = cube();
    mesh.positions.emplace_back(7, 8, 9);
    for (const PolygonMesh& fine : {*refine(mesh, catmull_clark, 2), *toLimit(mesh, catmull_clark, 2)})
        EXPECT_EQ(fine.positions[8], Vector3f(7, 8, 9));
}
