// A triangle: a pipeline, a target, a command and a picture.

#include "common/device.h"

#include <glint/math/math.h>

#include <cmath>
#include <cstddef>

using namespace glint;

namespace {

struct Vertex {
    Vector2f position;
    Vector4f color;
};

constexpr Vertex vertices[] = {
    {{1.0f, -1.0f}, {1.0f, 0.0f, 0.0f, 1.0f}},
    {{-1.0f, -1.0f}, {0.0f, 1.0f, 0.0f, 1.0f}},
    {{0.0f, 1.0f}, {0.0f, 0.0f, 1.0f, 1.0f}},
};

struct Parameters {
    Vector2f scale;
    Vector2f rotation;  // cosine and sine
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "A triangle, drawn into a texture.");
    if (!example.parse(argc, argv)) return example.exitCode();

    Device device = openDevice(example);
    if (!device) return report(device.error());

    Pipeline pipeline = device.createPipeline("triangle");
    pipeline.setUniformMask(0, Shader::MaskVertex);
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGf32, 0, offsetof(Vertex, position), sizeof(Vertex));
    pipeline.addAttribute(Pipeline::AttributeColor, FormatRGBAf32, 0, offsetof(Vertex, color), sizeof(Vertex));
    pipeline.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", "VERTEX_SHADER=1");
    pipeline.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader", "FRAGMENT_SHADER=1");
    if (!pipeline.create()) return report(pipeline.error());

    Texture picture = device.createTexture2D(FormatRGBAu8n, example.width(), example.height(), Texture::FlagTarget);
    Target target = device.createTarget(picture);
    target.setClearColor(Color::gray());

    PassTimer timer(example, device);
    for (uint32_t frame = 0; frame < example.options().frames; frame++) {
        const float angle = static_cast<float>(example.time(frame));
        const Parameters parameters = {{0.75f / example.aspect(), 0.75f}, {std::cos(angle), std::sin(angle)}};

        Command command = device.createCommand(target);
        timer.begin(command, "triangle");
        command.setPipeline(pipeline);
        command.setUniform(0, parameters);
        command.setVertices(0, vertices);
        command.drawArrays(3);
        timer.end(command);
        if (Status status = device.submit(command); !status) return report(status.error());
        if (Status status = timer.collect(); !status) return report(status.error());
    }
    return finish(example, device, picture);
}
