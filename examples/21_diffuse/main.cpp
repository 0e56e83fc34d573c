// Lambert's law, with the triangles' own normals and with those interpolated from their corners.

#include "common/course.h"

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Shades a mesh by Lambert's law, with geometric and with interpolated normals.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    float split = 0.5f;
    example.addKnob("--split", split, 0.0f, 1.0f, "Left of it normals are the triangles': a share of the width");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    return course.run(1, load, [&](Compute& compute) { compute.setUniform(1, split); });
}
