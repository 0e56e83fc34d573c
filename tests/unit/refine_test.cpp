#include "support/matchers.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>

#include <gtest/gtest.h>

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
    const Expected<PolygonMesh> fine = refine(cage, Subdivision::CatmullClark, 4);
    ASSERT_THAT(fine, IsOk());
    EXPECT_EQ(fine->faceCount(), 45056u);
    EXPECT_EQ(fine->positions.size(), 45056u);
    const Expected<Mesh> mesh = toTriangles(*fine);
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->triangleCount(), 90112u);
    EXPECT_TRUE(isClosed(*mesh));
    EXPECT_GT(volumeOf(*mesh), 0.0);
}
