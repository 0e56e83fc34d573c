// Phong's model: a highlight where the mirrored ray comes near the lamp.

#include "common/course.h"

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Shades a mesh by Phong's model.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    struct Settings {
        float specular = 0.4f, shininess = 40.0f;
    } settings;
    example.addKnob("--specular", settings.specular, 0.0f, 1.0f, "Strength of the highlight");
    example.addKnob("--shininess", settings.shininess, 1.0f, 500.0f, "The more, the smaller the highlight");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    return course.run(1, load, [&](Compute& compute) { compute.setUniform(1, settings); });
}
