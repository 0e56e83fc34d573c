// What an example of the course adds to the stage, on a null device.

#include "common/course.h"
#include "support/files.h"

#include <gtest/gtest.h>

namespace glint::test {

namespace {

struct Outcome {
    int exit_code = 0;
    std::string errors;
};

/// Runs the first example's shaders without a driver.
Outcome run(const CourseBuffers::Arrange& arrange) {
    const char* arguments[] = {"20_normals", "--api", "null", "--size", "32x16", "--query"};
    Example example("20_normals", "A test.");
    Course course(example, GLINT_SOURCE_DIR "/examples/20_normals/main.shader");
    course.setArrange(arrange);
    Outcome outcome;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(example.parse(static_cast<int>(std::size(arguments)), arguments));
    outcome.exit_code = course.run(
        1, [](Traversal&) {}, [](Compute& compute) { compute.setUniform(1, uint32_t{0}); });
    testing::internal::GetCapturedStdout();
    outcome.errors = testing::internal::GetCapturedStderr();
    return outcome;
}

}  // namespace

TEST(CourseArrange, MayChangeInstancesAndAddSome) {
    std::vector<Tracing::Instance> given;
    const Outcome outcome = run([&](Device& device, std::vector<Tracing::Instance>& instances) -> Status {
        EXPECT_TRUE(device);
        given = instances;
        instances.push_back(instances[CourseStage::object_mesh]);
        return {};
    });
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.errors, "");
    ASSERT_EQ(given.size(), CourseStage::object_count);
    for (const Tracing::Instance& instance : given) EXPECT_NE(instance.tracing, nullptr);
}

TEST(CourseArrange, EndsTheExampleIfItFails) {
    const Outcome failed = run([](Device&, std::vector<Tracing::Instance>&) -> Status {
        return Error(ErrorCode::Io, "file.open", "no picture");
    });
    EXPECT_EQ(failed.exit_code, 1);
    EXPECT_NE(failed.errors.find("no picture"), std::string::npos);

    // What it has spoilt is told as usual.
    const Outcome spoilt = run([](Device&, std::vector<Tracing::Instance>& instances) -> Status {
        instances[0].mask = 0x100;
        return {};
    });
    EXPECT_EQ(spoilt.exit_code, 1);
    EXPECT_NE(spoilt.errors.find("tracing.instance_bits"), std::string::npos) << spoilt.errors;
}

}  // namespace glint::test
