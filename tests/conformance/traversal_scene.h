#pragma once

// What the tests of ray-tracing pipelines share: small structures, and rays that look down at them.

#include "conformance/conformance.h"

#include <array>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint::test {

/// A shader of a pipeline, and its macros.
struct RayShader {
    Shader::Type type = Shader::TypeRayGen;
    std::string text;
    std::string macros;
};

/// What rays of look_down pass to traceRayEXT: its push constants.
struct RayArguments {
    uint32_t flags = 0;
    uint32_t mask = 0xff;
    uint32_t offset = 0;
    uint32_t stride = 0;
    uint32_t miss = 0;
    float minimum = 0;
    float maximum = 100;
};

enum RayFlag : uint32_t {
    RayOpaque = 1,
    RayTransparent = 2,
    RayFirst = 4,
    RaySkipClosest = 8,
    RayCullBack = 16,
    RayCullFront = 32,
    RayCullOpaque = 64,
    RayCullTransparent = 128,
};

/// Ray i looks down at (i + 0.5, 0.25) from z = 10, which is on the edge of no triangle; its payload, which begins as
/// 7, goes to storage 0.
constexpr const char* look_down = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(push_constant) uniform Push { uint flags, mask, offset, stride, miss; float minimum, maximum; };
layout(location = 0) rayPayloadEXT uint payload;
void main() {
    payload = 7u;
    vec3 origin = vec3(float(gl_LaunchIDEXT.x) + 0.5, 0.25, 10.0);
    traceRayEXT(scene, flags, mask, offset, stride, miss, origin, minimum, vec3(0.0, 0.0, -1.0), maximum, 0);
    results[gl_LaunchIDEXT.x] = payload;
}
)";

/// A shader that sets the payload.
inline std::string setPayload(std::string_view value) {
    return "layout(location = 0) rayPayloadInEXT uint payload;\nvoid main() { payload = " + std::string(value) +
           "; }\n";
}

using Words = std::vector<uint32_t>;

class TraversalTest : public ConformanceTest {
protected:
    using ConformanceTest::ConformanceTest;
    using Bounds = std::array<float, 6>;  ///< minimum, maximum

    void SetUp() override {
        ConformanceTest::SetUp();
        if (!device) return;
        GLINT_NEED_FEATURE(FeatureRayTracing);
    }

    Traversal makeTraversal(const std::vector<RayShader>& shaders,
                            const std::function<void(Traversal&)>& configure = {}) {
        Traversal traversal = device.createTraversal("traversal");
        for (const RayShader& shader : shaders) traversal.createShaderGLSL(shader.type, shader.text, shader.macros);
        if (configure) configure(traversal);
        EXPECT_THAT(traversal.create(), IsOk());
        return traversal;
    }

    static std::vector<float> corners(float x, float z = 0) {
        return {x, 0, z, x + 1, 0, z, x + 1, 1, z, x, 0, z, x + 1, 1, z, x, 1, z};
    }

    /// Unit squares from (x, 0) to (x + 1, 1) at height z, each a geometry of two triangles that turn counter-clockwise
    /// as seen from above.
    Tracing makeSquares(std::initializer_list<float> lefts, float z = 0,
                        Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing tracing = device.createTracing("squares");
        for (const float x : lefts)
            tracing.addVertexBuffer(6, FormatRGBf32, 12, makeBuffer(corners(x, z), Buffer::FlagTracing));
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

    static Tracing::Instance place(const Tracing& tracing, float x = 0, float z = 0, uint32_t offset = 0) {
        Tracing::Instance instance;
        instance.tracing = &tracing;
        instance.transform[3] = x;
        instance.transform[11] = z;
        instance.offset = offset;
        return instance;
    }

    /// What a pipeline writes to storage 0, where `count` words are.
    Words trace(const Traversal& traversal, size_t count, const std::function<void(Compute&)>& record) {
        const Buffer results = makeBuffer(Words(count, 0xdeadu));
        compute([&](Compute& list) {
            list.setTraversal(traversal);
            list.setStorageBuffer(0, results);
            record(list);
        });
        return read<uint32_t>(results);
    }

    /// The payloads of `count` rays of look_down.
    Words lookDown(const Traversal& traversal, const Tracing& scene, size_t count, const RayArguments& rays = {}) {
        return trace(traversal, count, [&](Compute& list) {
            list.setTracing(0, scene);
            list.setPushConstants(rays);
            list.dispatch(count);
        });
    }

    void build(const Tracing& tracing) { EXPECT_THAT(device.buildTracings({tracing}), IsOk()); }
};

}  // namespace glint::test
