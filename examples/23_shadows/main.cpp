// A ray from each hit to the lamp: any hit on its way is a shadow.

#include "common/course.h"

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces the shadows of a mesh.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    bool use_any_hit = false;
    example.add("--any-hit", use_any_hit, "Let an any-hit shader end shadow rays, instead of a flag: the same picture");
    if (!example.parse(argc, argv)) return example.exitCode();

    Shader::setMacro("ANY_HIT", use_any_hit);
    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "SHADOW_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
        if (!use_any_hit) return;
        // A hit group of its own: rays choose by the offset that they are traced with.
        traversal.addHitGroup();
        traversal.loadShaderGLSL(Shader::TypeFirstHit, course.shader(), "ANY_HIT_SHADER=1");
    };
    // The shadow's ray is traced by the closest-hit shader.
    return course.run(2, load);
}
