// A picture of all directions as surroundings and as the light: seen, mirrored, and gathered.

#include "25_environment/environment.h"
#include "common/course.h"

using namespace glint;

namespace {

struct Settings {
    uint32_t samples = 16;
    float exposure = 1.0f;
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Lights a mesh by a picture of all directions.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    std::filesystem::path path;
    Settings settings;
    example.add("--environment", path,
                "Latitude-longitude picture (.exr, .hdr, .png, .jpg), or sky, which is made by formula; without it one "
                "of the package blender-data if that is installed, else sky");
    example.addKnob("--samples", settings.samples, 1, 1024, "Rays that gather light where the floor is seen");
    example.addKnob("--exposure", settings.exposure, 0.0f, 8.0f, "Times the light");
    if (!example.parse(argc, argv)) return example.exitCode();
    const Expected<Image> environment = loadEnvironment(path);
    if (!environment) return report(environment.error());

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "GATHER_MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
    };
    Texture texture;
    Sampler sampler;
    course.setArrange([&](Device& device, std::vector<Tracing::Instance>&) -> Status {
        texture = device.createTexture2D(environment->format(), environment->width(), environment->height(),
                                         Texture::FlagMipmaps, "environment");
        device.setTexture(texture, environment->bytes().data(), environment->bytes().size());
        device.createMipmaps(texture);
        sampler = device.createSampler(Sampler::FilterTrilinear, Sampler::WrapModeRepeat);
        return texture.error();
    });
    // The camera's ray, two mirrors', and those that gather.
    return course.run(4, load, [&](Compute& compute) {
        compute.setUniform(1, settings);
        compute.setTexture(0, texture);
        compute.setSampler(0, sampler);
    });
}
