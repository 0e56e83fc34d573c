// Limits of subdivision surfaces: positions and normals where refining without end would lead.

#include "cages.h"

#include <glm/geometric.hpp>

using namespace glint;
using namespace glint::test;

TEST(Limit, PositionsAreWhereRefiningLeads) {
    for (const CageCase& c : cageCases()) {
        SCOPED_TRACE(std::string(c.name) + (c.scheme == loop ? ", Loop, " : ", Catmull-Clark, ") +
                     std::to_string(c.cage.creases.size()) + " creases");
        const ReferenceSurface reference(c.cage);
        const Expected<PolygonMesh> limit = toLimit(c.cage, c.scheme);
        ASSERT_THAT(limit, IsOk());
        for (uint32_t vertex = 0; vertex < c.cage.positions.size(); vertex++) {
            const Vector3d expected = limitPosition(reference, vertex, c.scheme);
            const double bound = roundingOf(expected, largestOf(c.cage));
            for (int axis = 0; axis < 3; axis++)
                EXPECT_NEAR(limit->positions[vertex][axis], expected[axis], bound) << "vertex " << vertex;
        }
    }
}

TEST(Limit, NormalsAreWhereRefiningLeads) {
    std::vector<CageCase> all = cageCases();
    // Darts.
    for (const uint32_t n : {3u, 4u, 5u, 6u, 8u, 11u}) {
        PolygonMesh cage = prism(n, true);
        cage.creases.push_back({0, 2 * n, infinity});
        shake(cage, n);
        all.push_back({"dart", catmull_clark, cage, true});
        PolygonMesh cut = triangles(prism(n, true));
        cut.creases.push_back({cut.indices[0], cut.indices[1], infinity});
        shake(cut, n);
        all.push_back({"dart", loop, cut, true});
    }
    size_t compared = 0;
    for (const CageCase& c : all) {
        SCOPED_TRACE(std::string(c.name) + (c.scheme == loop ? ", Loop, " : ", Catmull-Clark, ") +
                     std::to_string(c.cage.positions.size()) + " vertices, " + std::to_string(c.cage.creases.size()) +
                     " creases");
        const ReferenceSurface reference(c.cage);
        const PolygonMesh limit = *toLimit(c.cage, c.scheme);
        const PolygonAttribute& normals = *limit.attribute("normal");
        std::map<std::pair<uint32_t, uint32_t>, int> sides;
        for (const auto& face : reference.faces)
            for (size_t k = 0; k < face.size(); k++) sides[std::minmax(face[k], face[(k + 1) % face.size()])]++;
        std::vector<uint32_t> sharp(c.cage.positions.size(), 0);
        for (const auto& [edge, count] : sides)
            if (count == 1 || reference.sharpness.count(edge)) sharp[edge.first]++, sharp[edge.second]++;
        std::vector<uint32_t> sector(normals.values.size() / 3, 0);
        for (const uint32_t index : normals.indices) sector[index]++;

        for (size_t face = 0; face < reference.faces.size(); face++)
            for (size_t k = 0; k < reference.faces[face].size(); k++) {
                const uint32_t vertex = reference.faces[face][k];
                const uint32_t index = normals.indices[c.cage.offsets[face] + k];
                const float* n = &normals.values[3 * index];
                const Vector3d normal(n[0], n[1], n[2]);
                EXPECT_NEAR(glm::length(normal), 1.0, 1e-6);
                // Some have no tangent plane, see toLimit.
                if (sharp[vertex] > 2) continue;
                if (sharp[vertex] == 2 && sector[index] >= (c.scheme == loop ? 6 : 4)) continue;
                const auto f = static_cast<uint32_t>(face);
                const Vector3d near = limitNormal(reference, vertex, f, c.scheme, 20);
                const Vector3d nearer = limitNormal(reference, vertex, f, c.scheme, 40);
                // The reference comes nearer with each step, by a factor or (one face at a crease) like 1 / steps: what
                // is left is no more than about what step 20 to 40 have brought. 1e-6 is for float32.
                const double left = glm::length(nearer - near);
                EXPECT_LE(glm::length(normal - nearer), 4 * left + 1e-6)
                    << "face " << face << " corner " << k << " sharp " << sharp[vertex] << " sector " << sector[index];
                EXPECT_LE(left, 0.1);
                compared += left < 1e-6;
            }
    }
    EXPECT_GT(compared, 700u);
}

// The limit does not depend on when it is taken.
TEST(Limit, IsTheSameAfterRefining) {
    for (const CageCase& c : cageCases()) {
        SCOPED_TRACE(c.name);
        const PolygonMesh early = *toLimit(c.cage, c.scheme), late = *toLimit(c.cage, c.scheme, 2);
        for (size_t i = 0; i < early.positions.size(); i++)
            for (int axis = 0; axis < 3; axis++)
                EXPECT_NEAR(early.positions[i][axis], late.positions[i][axis],
                            2 * roundingOf(Vector3d(early.positions[i]), largestOf(c.cage)))
                    << "vertex " << i;
    }
}

// The parameters are an attribute: refined and brought to the limit as positions are, they come out at the limit's own.
TEST(Limit, RegularQuadrilateralsAreBicubicSplines) {
    PolygonMesh cage = grid(6, 7, 0.3f);
    PolygonAttribute parameters{.name = "parameters", .components = 2, .values = {}, .indices = cage.indices};
    for (int j = 0; j < 7; j++)
        for (int i = 0; i < 6; i++) parameters.values.insert(parameters.values.end(), {float(i), float(j)});
    cage.attributes.push_back(parameters);
    std::vector<Vector3d> points;
    for (const Vector3f& p : cage.positions) points.emplace_back(p);

    const PolygonMesh limit = *toLimit(cage, catmull_clark, 3);
    const PolygonAttribute& where = *limit.attribute("parameters");
    const PolygonAttribute& normals = *limit.attribute("normal");
    for (size_t corner = 0; corner < limit.indices.size(); corner++) {
        const double u = where.values[2 * where.indices[corner]], v = where.values[2 * where.indices[corner] + 1];
        // Eighths, but for rounding.
        ASSERT_NEAR(u * 8, std::round(u * 8), 1e-5);
        const SplinePoint expected = bicubicSpline(points, 6, std::round(u * 8) / 8, std::round(v * 8) / 8);
        const Vector3d position(limit.positions[limit.indices[corner]]);
        for (int axis = 0; axis < 3; axis++)
            ASSERT_NEAR(position[axis], expected.value[axis], roundingOf(expected.value, 7.0)) << u << ", " << v;
        const float* n = &normals.values[3 * normals.indices[corner]];
        // Components of a unit vector in float32.
        ASSERT_LE(glm::length(Vector3d(n[0], n[1], n[2]) - glm::normalize(glm::cross(expected.du, expected.dv))), 1e-7);
    }
}

TEST(Limit, RegularTrianglesAreBoxSplines) {
    PolygonMesh cage = grid(7, 6, 0.3f, true);
    PolygonAttribute parameters{.name = "parameters", .components = 2, .values = {}, .indices = cage.indices};
    for (int j = 0; j < 6; j++)
        for (int i = 0; i < 7; i++) parameters.values.insert(parameters.values.end(), {float(i), float(j)});
    cage.attributes.push_back(parameters);
    std::vector<Vector3d> points;
    for (const Vector3f& p : cage.positions) points.emplace_back(p);

    const PolygonMesh limit = *toLimit(cage, loop, 2);
    const PolygonAttribute& where = *limit.attribute("parameters");
    const PolygonAttribute& normals = *limit.attribute("normal");
    std::set<uint32_t> seen;
    for (size_t corner = 0; corner < limit.indices.size(); corner++) {
        const double u = where.values[2 * where.indices[corner]], v = where.values[2 * where.indices[corner] + 1];
        if (u < 1.99 || u > 4.01 || v < 1.99 || v > 3.01 || !seen.insert(limit.indices[corner]).second) continue;
        ASSERT_NEAR(u * 4, std::round(u * 4), 1e-5);
        const SplinePoint expected = boxSpline(points, 7, std::round(u * 4) / 4, std::round(v * 4) / 4);
        const Vector3d position(limit.positions[limit.indices[corner]]);
        // The reference is evaluated 1.3e-10 away from the place, where it slopes by less than 2.
        for (int axis = 0; axis < 3; axis++)
            EXPECT_NEAR(position[axis], expected.value[axis], roundingOf(expected.value, 7.0) + 3e-10);
        const float* n = &normals.values[3 * normals.indices[corner]];
        EXPECT_LE(glm::length(Vector3d(n[0], n[1], n[2]) - glm::normalize(glm::cross(expected.du, expected.dv))), 1e-7);
    }
    EXPECT_EQ(seen.size(), 9u * 5u);
}

TEST(Limit, TangentsThatVanish) {
    // Two triangles back to back: nothing is left to be told from the tangents.
    const PolygonMesh pillow = makeMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}});
    for (const Subdivision scheme : {catmull_clark, loop})
        for (const uint32_t steps : {0u, 1u, 3u}) {
            const Expected<PolygonMesh> limit = toLimit(pillow, scheme, steps);
            ASSERT_THAT(limit, IsOk());
            EXPECT_EQ(eulerCharacteristic(*limit), scheme == loop && steps > 0 ? eulerCharacteristic(*limit) : 2);
            for (const float x : limit->attribute("normal")->values) EXPECT_TRUE(std::isfinite(x));
        }
    PolygonMesh point = cube();
    for (Vector3f& p : point.positions) p = {1, 2, 3};
    const PolygonMesh limit = *toLimit(point, catmull_clark, 2);
    for (const Vector3f& p : limit.positions) EXPECT_EQ(p, Vector3f(1, 2, 3));
    const PolygonAttribute& normals = *limit.attribute("normal");
    for (size_t i = 0; i < normals.values.size(); i += 3) EXPECT_EQ(normals.values[i + 2], 1.0f);
}

TEST(Limit, WantsCreasesDone) {
    PolygonMesh cage = cube();
    cage.creases = {{0, 1, 1.5f}, {1, 2, infinity}};
    EXPECT_THAT(toLimit(cage, catmull_clark, 1), HasErrorId("refine.crease_left"));
    EXPECT_THAT(toLimit(cage, catmull_clark, 2), IsOk());
}
