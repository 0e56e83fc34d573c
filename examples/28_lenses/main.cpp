// Lenses as callable shaders, among groups of groups of one mesh, each of its own material.

#include "common/course.h"

#include <glint/graphics/instance_group.h>

#include <algorithm>
#include <array>
#include <cstdio>

using namespace glint;

namespace {

struct Settings {
    uint32_t lens = 0;
    float angle = 0.0f;  ///< radians
};

/// What the record of a hit group holds.
struct Material {
    Vector4f color;
    float specular = 0.4f, shininess = 40.0f;
    Vector2f padding = {0, 0};  // arrays in blocks have steps of 16 bytes
};

/// The floor's colour is that of its checkers.
const std::array<Material, 7> materials = {{{{1.00f, 1.00f, 1.00f, 1}, 0.0f},
                                            {{0.80f, 0.42f, 0.22f, 1}, 0.4f},
                                            {{0.16f, 0.36f, 0.62f, 1}, 0.6f, 90.0f},
                                            {{0.78f, 0.66f, 0.26f, 1}, 0.5f, 20.0f},
                                            {{0.30f, 0.55f, 0.28f, 1}, 0.2f, 12.0f},
                                            {{0.62f, 0.20f, 0.30f, 1}, 0.6f, 90.0f},
                                            {{0.70f, 0.70f, 0.72f, 1}, 0.3f, 30.0f}}};

Tracing::Instance moved(Tracing::Instance instance, const Matrix4x4f& matrix, uint32_t material) {
    Transform3x4 transform;
    std::copy(std::begin(instance.transform), std::end(instance.transform), transform.rows.begin());
    transform = Transform3x4(matrix * transform.matrix());
    std::copy(transform.rows.begin(), transform.rows.end(), instance.transform);
    instance.offset = material;
    return instance;
}

/// The mesh with a small one beside it; ten such pairs in a ring; and two rings, the outer one larger, about the mesh.
Expected<std::vector<Tracing::Instance>> arrange(const std::vector<Tracing::Instance>& course) {
    const Tracing::Instance& mesh = course[CourseStage::object_mesh];
    enum : uint32_t { pair, ring, all };
    std::vector<InstanceGroup> groups(3);
    groups[pair].add(moved(mesh, Matrix4x4f(1.0f), 0));
    groups[pair].add(moved(mesh, translate({-1.2f, 1.7f, 0}) * scale(Vector3f(0.4f)), 1));
    for (uint32_t i = 0; i < 10; i++)
        groups[ring].add(pair, Transform3x4(rotateZ(36.0f * static_cast<float>(i)) * translate({-9, 0, 0})), i % 2);
    groups[all].add(moved(course[CourseStage::object_floor], scale({6, 6, 1}), 0));
    groups[all].add(moved(mesh, Matrix4x4f(1.0f), 1));
    groups[all].add(ring, Transform3x4(), 2);
    groups[all].add(ring, Transform3x4(rotateZ(18.0f) * scale(Vector3f(1.7f))), 4);
    return flattenInstances(groups, all);
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Looks at a mesh through lenses that are callable shaders.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    std::string lens = "fisheye";
    float angle = 0.0f;
    example.add("--lens", lens, "pinhole, fisheye or spherical");
    example.addKnob("--angle", angle, 0.0f, 360.0f,
                    "Degrees from bottom to top; 0: 75 for pinholes (at most 170), 200 for fisheyes");
    if (!example.parse(argc, argv)) return example.exitCode();
    const std::array<std::string, 3> lenses = {"pinhole", "fisheye", "spherical"};
    const auto found = std::find(lenses.begin(), lenses.end(), lens);
    if (found == lenses.end()) {
        std::fprintf(stderr, "--lens: '%s' is none of pinhole, fisheye, spherical\n", lens.c_str());
        return 2;
    }
    const auto number = static_cast<uint32_t>(found - lenses.begin());

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "SHADOW_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeCallable, course.shader(), "CALLABLE_SHADER=1; LENS=pinholeLens");
        traversal.loadShaderGLSL(Shader::TypeCallable, course.shader(), "CALLABLE_SHADER=1; LENS=fisheyeLens");
        traversal.loadShaderGLSL(Shader::TypeCallable, course.shader(), "CALLABLE_SHADER=1; LENS=sphericalLens");
        // One hit group, as often as there are materials: instances choose by their offset.
        for (const Material& material : materials) traversal.addHitRecord(0, material);
    };
    course.setArrange([](Device&, std::vector<Tracing::Instance>& instances) -> Status {
        Expected<std::vector<Tracing::Instance>> arranged = arrange(instances);
        if (!arranged) return arranged.error();
        instances = std::move(*arranged);
        return {};
    });
    return course.run(2, load, [&](Compute& compute) {
        const float degrees = angle > 0.0f ? angle : number == 0 ? 75.0f : 200.0f;
        compute.setUniform(1, Settings{number, radians(number == 0 ? std::min(degrees, 170.0f) : degrees)});
        compute.setUniform(2, materials);
    });
}
