// The pictures of the ray-tracing course: the two forms of each against one another, and the first four against a
// float64 rendering.

#include "golden/render.h"
#include "support/course_reference.h"
#include "support/image_compare.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace glint::test {

namespace {

constexpr uint32_t width = 160, height = 90;

struct CourseCase {
    const char* program;
    CourseShading shading;
    const char* arguments = "";
};

void PrintTo(const CourseCase& course, std::ostream* stream) { *stream << course.program << course.arguments; }

class CourseReferenceTest : public ::testing::TestWithParam<CourseCase> {};

std::string nameOf(const ::testing::TestParamInfo<CourseCase>& info) {
    std::string name;
    for (const char c : std::string(info.param.program) + info.param.arguments)
        if (std::isalnum(c)) name += c;
    return name;
}

/// Compares pictures with the float64 rendering of a mesh.
void expectReference(const CourseCase& course, const std::filesystem::path& mesh, float time) {
    const TempDir folder;
    std::string arguments = "--size 160x90 --time " + std::to_string(time) + course.arguments;
    if (!mesh.empty()) arguments += " --mesh '" + mesh.string() + "'";
    const Expected<Image> pipeline = renderExample(course.program, arguments + " --tracing driver", folder);
    const Expected<Image> query = renderExample(course.program, arguments + " --query", folder);
    ASSERT_TRUE(pipeline && query);
    ASSERT_EQ(pipeline->width(), width);
    ASSERT_EQ(pipeline->height(), height);

    const Expected<CourseStage> stage = CourseStage::load(mesh);
    ASSERT_TRUE(stage) << stage.error().text();
    const CourseReference reference(*stage, course.shading, time, width, height);
    Expected<Image> picture = Image::create(FormatRGBAu8n, width, height);
    ASSERT_TRUE(picture);
    uint32_t edges = 0, misses = 0, shadows = 0, wrong = 0, unequal = 0;
    double largest = 0.0;
    std::string first;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const CourseReference::Pixel exact = reference.pixel(x, y);
            picture->store(x, y, Vector4f(Vector3f((exact.low + exact.high) * 0.5), 1.0f));
            misses += exact.is_miss;
            shadows += exact.is_shadow;
            const bool is_edge = exact.isEdge();
            edges += is_edge;
            unequal += pipeline->load(x, y) != query->load(x, y);
            for (const Image* image : {&*pipeline, &*query}) {
                const Vector3d color(Vector3f(image->load(x, y)));
                const Vector3d outside = glm::max(glm::max(exact.low - color, color - exact.high), Vector3d(0.0));
                const double error = std::max({outside.x, outside.y, outside.z});
                if (!is_edge) largest = std::max(largest, error);
                if (is_edge || error <= CourseReference::shade_error) continue;
                if (wrong++ == 0)
                    first = "(" + std::to_string(x) + ", " + std::to_string(y) + ") by " +
                            std::to_string(error * 255.0) + " steps";
            }
        }
    const std::string name = std::string(course.program) + (mesh.empty() ? "_float64" : "_mesh_float64");
    EXPECT_TRUE(picture->save(outputDir() / (name + ".png")));
    const double pixels = static_cast<double>(width) * height;
    std::printf("%.2f%% of the pixels are edges, %.1f%% miss, %.1f%% are in shadow, %u differ between pipeline and "
                "queries; largest error elsewhere %.3f of %.3f steps\n",
                edges / pixels * 100.0, misses / pixels * 100.0, shadows / pixels * 100.0, unequal, largest * 255.0,
                CourseReference::shade_error * 255.0);
    EXPECT_EQ(wrong, 0u) << first;
    // Borders are few pixels here; if they were many, nothing would be compared.
    EXPECT_LT(edges, pixels * 0.05);
    EXPECT_GT(misses, pixels * 0.05);
    EXPECT_EQ(shadows > pixels * 0.01, course.shading == CourseShading::Shadows);
}

}  // namespace

TEST_P(CourseReferenceTest, AgreesWithFloat64) { expectReference(GetParam(), {}, 0.0f); }

INSTANTIATE_TEST_SUITE_P(Examples, CourseReferenceTest,
                         ::testing::Values(CourseCase{"20_normals", CourseShading::Normals},
                                           CourseCase{"21_diffuse", CourseShading::Diffuse},
                                           CourseCase{"22_phong", CourseShading::Phong},
                                           CourseCase{"23_shadows", CourseShading::Shadows},
                                           CourseCase{"23_shadows", CourseShading::Shadows, " --any-hit"}),
                         nameOf);

// A mesh of a file, from another side, with long edges between light and dark.
TEST(CourseReference, AgreesOnTheBunny) {
    GLINT_NEED_BUNNY();
    expectReference({"23_shadows", CourseShading::Shadows}, bunnyPath(), 3.0f);
}

// Mirrors that bend multiply what rounding moves a ray by: here by 2 * distance / radius, about 9, with each reflection
// on the torus. So after four of them the 2^-17 (|origin| + t) of the first ray may be more than the scene, but few
// pixels show the torus in the torus more than once. With one reflection the edges are those of shadows, and as many
// again in the floor's mirror.
TEST(Course, ReflectionsAreTheSameByQueries) {
    for (const char* depth : {" --depth 1", " --depth 4"}) {
        const TempDir folder;
        const std::string arguments = std::string("--size 160x90") + depth;
        const Expected<Image> pipeline = renderExample("24_reflections", arguments + " --tracing driver", folder);
        const Expected<Image> query = renderExample("24_reflections", arguments + " --query", folder);
        ASSERT_TRUE(pipeline && query);
        EXPECT_TRUE(imagesMatch(*pipeline, *query, "24_reflections_query", {.texels = 25})) << depth;
    }
}

}  // namespace glint::test
