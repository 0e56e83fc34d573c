// A triangle: a pipeline, a target, a command.

#include "common/viewer.h"

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
    Example example(EXAMPLE_NAME, "A triangle.");
    float size = 0.75f;
    example.addKnob("--scale", size, 0.1f, 2.0f, "Half the height of the triangle, of that of the picture");
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

    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) {
        const float angle = static_cast<float>(frame.time) + frame.view.turn();
        const float scale = size / frame.view.distance();
        const Parameters parameters = {{scale / frame.aspect(), scale}, {std::cos(angle), std::sin(angle)}};

        frame.target.setClearColor(Color::gray());
        Command command = device.createCommand(frame.target);
        frame.timer.begin(command, "triangle");
        command.setPipeline(pipeline);
        command.setUniform(0, parameters);
        command.setVertices(0, vertices);
        command.drawArrays(3);
        frame.timer.end(command);
        return device.submit(command);
    });
    if (!status) return report(status.error());
    return viewer.finish();
}
