#include "conformance/traversal_scene.h"

namespace glint::test {

namespace {

TEST_F(TraversalTest, TracesHitsAndMisses) {
    const Tracing squares = makeSquares({0, 2});
    const Tracing scene = makeTop({place(squares)});
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, lookDown()},
                                               {Shader::TypeRayMiss, setPayload("1u")},
                                               {Shader::TypeClosest, setPayload("2u + uint(gl_GeometryIndexEXT)")}});
    EXPECT_EQ(trace(traversal, scene, 5, 4), (std::vector<uint32_t>{2, 1, 3, 1, 0xdead}));
}

TEST_F(TraversalTest, RendersOnSurface) {
    const Tracing squares = makeSquares({0});
    const Tracing scene = makeTop({place(squares)});
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, rgba8) writeonly uniform image2D surface;
layout(location = 0) rayPayloadEXT vec4 color;
void main() {
    vec2 place = (vec2(gl_LaunchIDEXT.xy) + 0.5) / vec2(gl_LaunchSizeEXT.xy) * 2.0;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, vec3(place, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 2.0, 0);
    imageStore(surface, ivec2(gl_LaunchIDEXT.xy), color);
}
)"},
                                               {Shader::TypeRayMiss, R"(
layout(location = 0) rayPayloadInEXT vec4 color;
void main() { color = vec4(0.0, 0.0, 1.0, 1.0); }
)"},
                                               {Shader::TypeClosest, R"(
layout(location = 0) rayPayloadInEXT vec4 color;
hitAttributeEXT vec2 barycentrics;
void main() { color = vec4(0.0, 1.0, 0.0, gl_HitTEXT); }
)"}});
    const Texture surface = makeTexture(FormatRGBAu8n, 16, 8, Texture::FlagSurface);
    compute([&](Compute& list) {
        list.setTraversal(traversal);
        list.setTracing(0, scene);
        list.setSurfaceTexture(0, surface);
        list.dispatch(surface);
    });
    const auto pixels = readTexture<Pixel>(surface);
    EXPECT_EQ(countPixels(pixels, green), 8 * 4u);
    EXPECT_EQ(countPixels(pixels, blue), 16 * 8u - 8 * 4u);
    EXPECT_EQ(pixels[0], green);
}

}  // namespace

}  // namespace glint::test
