#pragma once

// Wrong uses of the API, each with the id of the message that it has to lead to. A case does one thing wrong and
// returns what carries the error; that the device tells of it, and of nothing else, is checked by misuse_test.cpp.

#include "conformance/conformance.h"

#include <array>
#include <string>
#include <vector>

namespace glint::test {

/// Valid objects for cases to misuse.
class MisuseKit {
public:
    Device device;
    Device bare;     ///< the same API without any optional feature
    Device foreign;  ///< another device
    MessageLog log;

    Buffer buffer(Buffer::Flags flags = Buffer::FlagStorage, uint64_t size = 256) {
        return device.createBuffer(flags, size, "buffer");
    }
    /// A buffer that failed; its own message is not the one that is waited for.
    Buffer failedBuffer() {
        Buffer failed = device.createBuffer(Buffer::FlagStorage, 0, "failed");
        log.take();
        return failed;
    }
    Texture texture(Texture::Flags flags = Texture::FlagTarget, Format format = FormatRGBAu8n) {
        return device.createTexture2D(format, 8, 8, flags, "texture");
    }
    Kernel kernel(std::string_view text) {
        Kernel result = device.createKernel("kernel");
        result.createShaderGLSL(text);
        EXPECT_THAT(result.create(), IsOk());
        return result;
    }
    /// Takes a uniform of 16 bytes and a storage buffer of at least 16.
    Kernel kernel() {
        return kernel(R"(
            layout(local_size_x = 8) in;
            layout(binding = 0) uniform Parameters { vec4 parameters; };
            layout(binding = 1) buffer Values { vec4 value; };
            void main() { value = parameters; })");
    }
    /// Draws positions of 16 bytes to one RGBAu8n texture.
    Pipeline pipeline(const std::function<void(Pipeline&)>& configure = {}) {
        Pipeline result = unfinished(configure);
        EXPECT_THAT(result.create(), IsOk());
        return result;
    }
    /// The same before create().
    Pipeline unfinished(const std::function<void(Pipeline&)>& configure = {}) {
        Pipeline result = device.createPipeline("pipeline");
        result.createShaderGLSL(Shader::TypeVertex, position_vertex);
        result.createShaderGLSL(Shader::TypeFragment, red_fragment);
        result.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
        result.setColorFormat(FormatRGBAu8n);
        if (configure) configure(result);
        return result;
    }
    Target target() { return device.createTarget(texture()); }

    /// A list with everything that kernel() wants; what `record` does to it is wrong.
    Error compute(const std::function<void(Compute&)>& record) {
        Compute list = device.createCompute();
        list.setKernel(kernel());
        list.setUniform(0, Color());
        list.setStorageBuffer(0, buffer());
        record(list);
        list.dispatch(8);
        return device.submit(list).error();
    }
    /// A list without anything set.
    Error list(const std::function<void(Compute&)>& record, Queue queue = Queue::Main) {
        Compute list = device.createCompute(queue);
        record(list);
        return device.submit(list).error();
    }
    Error command(const std::function<void(Command&)>& record) {
        Command list = device.createCommand(target());
        record(list);
        return device.submit(list).error();
    }
    Error program(std::string_view text, const std::function<void(Kernel&)>& configure = {}) {
        Kernel result = device.createKernel("kernel");
        result.createShaderGLSL(text);
        if (configure) configure(result);
        return result.create().error();
    }
    Error draws(const std::function<void(Pipeline&)>& configure) { return unfinished(configure).create().error(); }

    /// One triangle.
    Tracing triangle(Tracing::Flags flags = Tracing::FlagFastTrace) {
        const std::array<float, 9> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        Tracing result = device.createTracing("triangle");
        result.addVertexBuffer(3, FormatRGBf32, 12, device.createBuffer(Buffer::FlagTracing, corners.data(), 36));
        EXPECT_THAT(result.create(Tracing::TypeTriangle, flags), IsOk());
        return result;
    }
    /// A structure being configured.
    Error configured(Tracing::Type type, const std::function<void(Tracing&)>& configure,
                     Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing result = device.createTracing("structure");
        configure(result);
        return result.create(type, flags).error();
    }
};

struct Misuse {
    const char* id;
    const char* name;
    Error (*run)(MisuseKit& kit);
};

/// All cases, in no particular order.
std::vector<Misuse>& misuses();

struct MisuseEntry {
    explicit MisuseEntry(const Misuse& misuse) { misuses().push_back(misuse); }
};

/// MISUSE(DepthWithoutFormat, "pipeline.depth") { return ...; }
#define MISUSE(name, id)                                             \
    static Error misuse##name(MisuseKit& kit);                       \
    static const MisuseEntry entry##name({id, #name, misuse##name}); \
    static Error misuse##name([[maybe_unused]] MisuseKit& kit)

}  // namespace glint::test
