// <glint/shading.h> on the device against float64.

#include "support/kernel_values.h"
#include "support/reference.h"

#include <algorithm>
#include <cmath>

namespace glint::test {

namespace {

constexpr const char* shader = R"(
#include <glint/shading.h>
layout(local_size_x = 64) in;
struct Input { vec4 direction, normal, geometric, to_light; };
struct Output { vec4 mirrored, facing, interpolated, encoded; };
layout(std430, binding = 0) readonly buffer Inputs { Input inputs[]; };
layout(std430, binding = 1) writeonly buffer Outputs { Output outputs[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= inputs.length()) return;
    const vec3 direction = inputs[i].direction.xyz, normal = inputs[i].normal.xyz, geometric = inputs[i].geometric.xyz;
    const vec3 to_light = inputs[i].to_light.xyz;
    outputs[i].mirrored = vec4(glintMirror(direction, normal, geometric), glintDiffuse(normal, to_light));
    outputs[i].facing = vec4(glintFaceRay(geometric, direction), glintPhong(normal, to_light, direction, 40.0));
    outputs[i].interpolated = vec4(glintInterpolate(direction, normal, geometric, to_light.xy), 0.0);
    outputs[i].encoded = vec4(glintEncodeSrgb(to_light * 1.2), 0.0);
}
)";

struct Input {
    Vector4f direction, normal, geometric, to_light;
};
struct Output {
    Vector4f mirrored, facing, interpolated, encoded;
};

double encode(double value) {
    value = std::clamp(value, 0.0, 1.0);
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

double largest(const Vector3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

class ShadingHelpers : public DeviceTest {};

}  // namespace

TEST_F(ShadingHelpers, AreWhatFloat64Gives) {
    // Directions that come from above a triangle, normals that lean from its own by up to 60 degrees, as on coarse
    // meshes.
    Random random(11);
    std::vector<Input> inputs;
    while (inputs.size() < 4096) {
        const Vector3d geometric = random.direction(), direction = random.direction();
        const Vector3d normal = glm::normalize(geometric + 0.9 * random.uniform() * random.direction());
        if (glm::dot(geometric, direction) > -1e-3) continue;
        inputs.push_back({Vector4f(Vector3f(direction), 0), Vector4f(Vector3f(normal), 0),
                          Vector4f(Vector3f(geometric), 0), Vector4f(Vector3f(random.direction()), 0)});
    }
    const std::vector<Output> outputs = runOnEach<Output>(device, shader, inputs);
    ASSERT_EQ(outputs.size(), inputs.size());

    constexpr double u = 0x1p-24;
    uint32_t below = 0, dark = 0, clamped = 0;
    for (size_t i = 0; i < inputs.size(); i++) {
        const Output& output = outputs[i];
        const Vector3d direction(Vector3f(inputs[i].direction)), normal(Vector3f(inputs[i].normal));
        const Vector3d geometric(Vector3f(inputs[i].geometric)), to_light(Vector3f(inputs[i].to_light));

        // A product of unit vectors has 3u; the mirrored direction twice that along the normal, and two roundings.
        const auto reflect = [&](const Vector3d& n) { return direction - 2.0 * glm::dot(n, direction) * n; };
        const Vector3d mirrored(Vector3f(output.mirrored));
        const Vector3d by_normal = reflect(normal), by_geometric = reflect(geometric);
        const double height = glm::dot(by_normal, geometric);
        below += height < 0.0;
        const double error_normal = largest(mirrored - by_normal), error_geometric = largest(mirrored - by_geometric);
        EXPECT_LE(height > 16 * u ? error_normal : 0.0, 10 * u);
        EXPECT_LE(height < -16 * u ? error_geometric : 0.0, 10 * u);
        EXPECT_GT(glm::dot(mirrored, geometric), -16 * u) << "into the surface";

        EXPECT_NEAR(output.mirrored.w, std::max(glm::dot(normal, to_light), 0.0), 3 * u);
        dark += output.mirrored.w == 0.0f;
        EXPECT_EQ(Vector3f(output.facing), Vector3f(inputs[i].geometric)) << "it faces the ray already";

        // The base is off by 16u; log2 by 2^-21 (from 1/2 on; smaller bases have powers below 2^-40), the exponent's
        // function by 3 + 2 * 40 ulp.
        const double base = std::max(glm::dot(by_normal, to_light), 0.0);
        const double power = std::pow(base, 40.0);
        EXPECT_NEAR(output.facing.w, power, power * (40 * (16 * u / std::max(base, 0.5) + 0x1p-21) + 83 * u) + 0x1p-36);

        const Vector3d mean =
            direction * (1.0 - to_light.x - to_light.y) + normal * to_light.x + geometric * to_light.y;
        // Weights of up to 3, three products and two sums.
        EXPECT_LE(largest(Vector3d(Vector3f(output.interpolated)) - mean), 24 * u);

        for (int k = 0; k < 3; k++) {
            // log2 of what is not between 1/2 and 2 has 3 ulp, of at most 8: 24 * 2u; by 1 / 2.4, and 3 + 2 * 3.5 ulp.
            // What is taken by the other branch, next to 0.0031308, differs by 3e-8.
            const double value = static_cast<double>(inputs[i].to_light[k]) * 1.2;
            EXPECT_NEAR(output.encoded[k], encode(value), 64 * u);
            clamped += value > 1.0;
        }
    }
    EXPECT_GT(below, 50u);
    EXPECT_GT(dark, 1000u);
    EXPECT_GT(clamped, 500u);
}

}  // namespace glint::test
