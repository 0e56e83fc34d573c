#pragma once

// What the tests of ray-tracing pipelines share: small structures, and pipelines whose rays look along -z.

#include "conformance/conformance.h"

#include <array>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint::test {

/// A shader of a pipeline.
struct RayShader {
    Shader::Type type = Shader::TypeRayGen;
    std::string text;
};

class TraversalTest : public ConformanceTest {
protected:
    using Bounds = std::array<float, 6>;  ///< minimum, maximum

    void SetUp() override {
        ConformanceTest::SetUp();
        if (HasFatalFailure() || !device) return;
        GLINT_NEED_FEATURE(FeatureRayTracing);
        // From here on the driver builds structures, too.
        device.createTraversal();
    }

    Traversal makeTraversal(const std::vector<RayShader>& shaders,
                            const std::function<void(Traversal&)>& configure = {}) {
        Traversal traversal = device.createTraversal("traversal");
        for (const RayShader& shader : shaders) traversal.createShaderGLSL(shader.type, shader.text);
        if (configure) configure(traversal);
        EXPECT_THAT(traversal.create(), IsOk());
        return traversal;
    }

    /// Triangles over the unit squares from (x, 0) to (x + 1, 1) at these x, each square a geometry of two triangles at
    /// height z, facing up.
    Tracing makeSquares(std::initializer_list<float> lefts, float z = 0,
                        Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing tracing = device.createTracing("squares");
        for (const float x : lefts) {
            const std::vector<float> corners = {x, 0, z, x + 1, 0, z, x + 1, 1, z, x, 0, z, x + 1, 1, z, x, 1, z};
            tracing.addVertexBuffer(6, FormatRGBf32, 12, makeBuffer(corners, Buffer::FlagTracing));
        }
        EXPECT_THAT(tracing.create(Tracing::TypeTriangle, flags), IsOk());
        build(tracing);
        return tracing;
    }

    Tracing makeBoxes(const std::vector<Bounds>& bounds, Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing tracing = device.createTracing("boxes");
        tracing.addBoundBuffer(static_cast<uint32_t>(bounds.size()), sizeof(Bounds),
                               makeBuffer(bounds, Buffer::FlagTracing));
        EXPECT_THAT(tracing.create(Tracing::TypeBound, flags), IsOk());
        build(tracing);
        return tracing;
    }

    Tracing makeTop(const std::vector<Tracing::Instance>& instances) {
        Tracing tracing = device.createTracing(instances, Tracing::FlagFastTrace, "top");
        EXPECT_TRUE(tracing) << tracing.error().text();
        build(tracing);
        return tracing;
    }

    static Tracing::Instance place(const Tracing& tracing, float x = 0, float y = 0, float z = 0, uint32_t offset = 0) {
        Tracing::Instance instance;
        instance.tracing = &tracing;
        instance.transform[3] = x;
        instance.transform[7] = y;
        instance.transform[11] = z;
        instance.offset = offset;
        return instance;
    }

    /// What the rays of a pipeline write to storage 0, as words: `count` of them.
    template <class T = uint32_t>
    std::vector<T> trace(const Traversal& traversal, const Tracing& scene, size_t count, uint64_t width,
                         uint64_t height = 1, uint64_t depth = 1, const std::function<void(Compute&)>& record = {}) {
        const Buffer results = makeBuffer(std::vector<T>(count, T(0xdead)));
        compute([&](Compute& list) {
            list.setTraversal(traversal);
            list.setTracing(0, scene);
            list.setStorageBuffer(0, results);
            if (record) record(list);
            list.dispatch(width, height, depth);
        });
        return read<T>(results);
    }

    void build(const Tracing& tracing) { EXPECT_THAT(device.buildTracings({tracing}), IsOk()); }
};

/// Ray i looks down at (i + 0.5, 0.5) from z = 10; its payload, which begins as 7, is written to storage 0. `EXTRA` may
/// change the arguments of traceRayEXT.
inline std::string lookDown(std::string_view flags = "gl_RayFlagsNoneEXT", std::string_view mask = "0xff",
                            std::string_view offset = "0", std::string_view stride = "0", std::string_view miss = "0") {
    std::string text = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(location = 0) rayPayloadEXT uint payload;
void main() {
    uint ray = gl_LaunchIDEXT.x;
    payload = 7u;
    traceRayEXT(scene, FLAGS, MASK, OFFSET, STRIDE, MISS, vec3(float(ray) + 0.5, 0.5, 10.0), 0.0,
                vec3(0.0, 0.0, -1.0), 100.0, 0);
    results[ray] = payload;
}
)";
    const auto put = [&](std::string_view name, std::string_view value) {
        text.replace(text.find(name), name.size(), value);
    };
    put("FLAGS", flags);
    put("MASK", mask);
    put("OFFSET", offset);
    put("STRIDE", stride);
    put("MISS", miss);
    return text;
}

/// A shader that sets the payload.
inline std::string setPayload(std::string_view value) {
    return "layout(location = 0) rayPayloadInEXT uint payload;\nvoid main() { payload = " + std::string(value) +
           "; }\n";
}

}  // namespace glint::test
