// What a ray has hit: the normals of a mesh as colours.

#include "common/course.h"

using namespace glint;

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Shows the normals of a mesh as colours.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    bool is_geometric = false;
    example.addKnob("--geometric", is_geometric, "The triangles' own normals, not those interpolated from corners");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    return course.run(1, load, [&](Compute& compute) { compute.setUniform(1, uint32_t{is_geometric}); });
}
