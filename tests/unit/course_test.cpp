// What the examples of the ray-tracing course share, on a null device.

#include "common/course.h"
#include "support/files.h"
#include "support/matchers.h"

#include <glint/geometry/primitives.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <cmath>

namespace glint::test {

namespace {

struct Outcome {
    int exit_code = 0;
    std::string errors;
    bool used_pipeline = false;
};

/// Runs the fifth example's shaders without a driver.
Outcome run(std::vector<const char*> arguments, uint32_t recursion) {
    arguments.insert(arguments.begin(), {"24_reflections", "--api", "null", "--size", "32x16"});
    Example example("24_reflections", "A test.");
    Course course(example, GLINT_SOURCE_DIR "/examples/24_reflections/main.shader");
    Outcome outcome;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(example.parse(static_cast<int>(arguments.size()), arguments.data()));
    const auto load = [&](Traversal& traversal) {
        outcome.used_pipeline = true;
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "SHADOW_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    outcome.exit_code = course.run(recursion, load, [](Compute& compute) { compute.setUniform(1, uint32_t{1}); });
    testing::internal::GetCapturedStdout();
    outcome.errors = testing::internal::GetCapturedStderr();
    return outcome;
}

}  // namespace

TEST(Course, TracesThroughAPipelineOrByQueries) {
    const Outcome pipeline = run({}, 3);
    EXPECT_EQ(pipeline.exit_code, 0);
    EXPECT_EQ(pipeline.errors, "");
    EXPECT_TRUE(pipeline.used_pipeline);
    const Outcome query = run({"--query"}, 3);
    EXPECT_EQ(query.exit_code, 0);
    EXPECT_EQ(query.errors, "");
    EXPECT_FALSE(query.used_pipeline);
}

TEST(Course, SaysThatQueriesStandIn) {
    const Outcome nested = run({}, 32);  // the null device's pipelines nest 31 deep
    EXPECT_EQ(nested.exit_code, 0);
    EXPECT_FALSE(nested.used_pipeline);
    EXPECT_NE(nested.errors.find("no ray-tracing pipelines whose traces nest 32 deep"), std::string::npos)
        << nested.errors;

    const null::ScopedSettings settings({.missing = FeatureRayTracing});
    EXPECT_TRUE(run({}, 1).used_pipeline);  // one of Glint's
    const Outcome missing = run({"--tracing", "driver"}, 1);
    EXPECT_EQ(missing.exit_code, 0);
    EXPECT_FALSE(missing.used_pipeline);
    EXPECT_NE(missing.errors.find("'null' has no ray-tracing pipelines"), std::string::npos) << missing.errors;
}

TEST(Course, SaysWhatIsWrongWithAMesh) {
    const Outcome outcome = run({"--mesh", "nowhere.obj"}, 3);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.errors.find("[file.open]"), std::string::npos) << outcome.errors;
    EXPECT_NE(outcome.errors.find("nowhere.obj"), std::string::npos) << outcome.errors;
}

// Whatever its size and place, a mesh stands on the floor, Y up and Z towards +X, and its longest side has 3 units.
TEST(CourseStage, StandsMeshesOnTheFloor) {
    const TempDir folder;
    Mesh mesh = createBox({2.0f, 40.0f, 10.0f});
    for (Vector3f& position : mesh.positions) position += Vector3f(100.0f, -7.0f, 3.0f);
    mesh.normals.clear();
    mesh.texcoords.clear();
    ASSERT_TRUE(mesh.save(folder / "box.ply"));
    const Expected<CourseStage> stage = CourseStage::load(folder / "box.ply");
    ASSERT_TRUE(stage) << stage.error().text();
    const Mesh& placed = stage->mesh(CourseStage::object_mesh);
    EXPECT_EQ(placed.normals.size(), placed.positions.size());
    BoundBox box;
    for (const Vector3f& position : placed.positions)
        (void)box.add(transformPoint(stage->transform(CourseStage::object_mesh).matrix(), position));
    // Of X, which was Z; of Y, which was X; of Z, which was Y. Coordinates up to 107 are off by 2^-18, times 3 / 40.
    const Vector3f low(-0.375f, -0.075f, CourseStage::lift), high(0.375f, 0.075f, 3.0f + CourseStage::lift);
    for (int i = 0; i < 3; i++) {
        EXPECT_NEAR(box.min[i], low[i], 1e-5f);
        EXPECT_NEAR(box.max[i], high[i], 1e-5f);
    }
    EXPECT_EQ(stage->transform(CourseStage::object_floor), Transform3x4());
    EXPECT_EQ(stage->mesh(CourseStage::object_floor).bounds().size().x, CourseStage::floor_size);
}

TEST(CourseStage, HasATorusOfItsOwn) {
    const Expected<CourseStage> stage = CourseStage::load({});
    ASSERT_TRUE(stage);
    EXPECT_EQ(stage->mesh(CourseStage::object_mesh).triangleCount(), 4096u);
    for (const float time : {0.0f, 5.0f}) {
        const Vector3f from = CourseStage::camera(time, 1.0f).position();
        EXPECT_NEAR(std::hypot(from.x, from.y), std::hypot(5.4f, 2.0f), 1e-5f);
        EXPECT_EQ(from.z, 3.1f);
    }
}

}  // namespace glint::test
