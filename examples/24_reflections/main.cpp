// Mirrors: the closest-hit shader traces on, until a limit.

#include "common/course.h"

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces mirror reflections of a mesh, and of reflections.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    constexpr uint32_t deepest = 8;
    uint32_t reflections = 4;
    example.addKnob("--depth", reflections, 0, deepest, "Reflections that may follow one another");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "SHADOW_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    // The camera's ray, as many reflections, and the shadow's ray of the last one.
    return course.run(deepest + 2, load, [&](Compute& compute) { compute.setUniform(1, reflections); });
}
