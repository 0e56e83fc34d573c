// Holes that the triangles know nothing of: an any-hit shader refuses hits where a texture has none of the mesh.

#include "27_cutout/holes.h"
#include "common/course.h"

#include <algorithm>

using namespace glint;

namespace {

struct Settings {
    float repeats = 1.0f;  ///< of the texture, in a unit of the mesh's own space
    float opacity = 1.0f;
    uint32_t is_stochastic = 0;
    uint32_t samples = 1;
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Cuts holes into a mesh by an any-hit shader.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    bool is_stochastic = false;
    uint32_t samples = 16;
    Settings settings;
    example.addKnob("--stochastic", is_stochastic, "Take the texture as a probability: borders are soft");
    example.addKnob("--opacity", settings.opacity, 0.0f, 1.0f, "Times the texture: how much of the mesh there is");
    example.addKnob("--samples", samples, 1, 256, "Rays a pixel, where they are random");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeFirstHit, course.shader(), "ANY_HIT_SHADER=1");
    };
    Texture texture;
    Sampler sampler;
    course.setArrange([&](Device& device, std::vector<Tracing::Instance>& instances) -> Status {
        const Vector3f size = course.stage().mesh(CourseStage::object_mesh).bounds().size();
        settings.repeats = 5.0f / std::max({size.x, size.y, size.z, 1e-30f});
        const Expected<Image> holes = createHoles();
        if (!holes) return holes.error();
        texture = device.createTexture2D(holes->format(), holes->width(), holes->height(), 0, "holes");
        device.setTexture(texture, holes->bytes().data(), holes->bytes().size());
        sampler = device.createSampler(Sampler::FilterLinear, Sampler::WrapModeRepeat);
        // Its hits are shown to the any-hit shader; the floor has no holes, and costs nothing.
        instances[CourseStage::object_mesh].flags = Tracing::InstanceTransparent;
        return texture.error();
    });
    return course.run(1, load, [&](Compute& compute) {
        settings.is_stochastic = is_stochastic;
        settings.samples = is_stochastic ? samples : 1;
        compute.setUniform(1, settings);
        compute.setTexture(0, texture);
        compute.setSampler(0, sampler);
    });
}
