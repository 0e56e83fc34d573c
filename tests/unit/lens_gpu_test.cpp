// <glint/lens.h>, <glint/environment.h>, <glint/random.h> and the refraction of <glint/shading.h> on the device against
// float64.

#include "support/kernel_values.h"
#include "support/reference.h"

#include <glint/math/math.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace glint::test {

namespace {

constexpr const char* shader = R"(
#include <glint/environment.h>
#include <glint/lens.h>
#include <glint/random.h>
#include <glint/shading.h>
layout(local_size_x = 64) in;
struct Input { vec4 place, direction, normal; };  // angle, eta in place.zw
struct Output { vec4 pinhole, fisheye, spherical, place, back, refracted; uvec4 hash; };
layout(std430, binding = 0) readonly buffer Inputs { Input inputs[]; };
layout(std430, binding = 1) writeonly buffer Outputs { Output outputs[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= inputs.length()) return;
    const vec2 place = inputs[i].place.xy;
    const float angle = inputs[i].place.z, eta = inputs[i].place.w;
    const vec3 direction = inputs[i].direction.xyz, normal = inputs[i].normal.xyz;
    outputs[i].pinhole = vec4(glintPinholeLens(place, 0.45 * angle), 0.0);
    outputs[i].fisheye = vec4(glintFisheyeLens(place, angle), 0.0);
    outputs[i].spherical = vec4(glintSphericalLens(place), 0.0);
    const vec2 seen = glintLatitudeLongitude(direction);
    outputs[i].place = vec4(seen, 0.0, 0.0);
    outputs[i].back = vec4(glintLatitudeLongitudeDirection(seen), 0.0);
    outputs[i].refracted = vec4(refract(direction, normal, eta), glintFresnel(-dot(normal, direction), eta));
    const uint hash = glintHash(glintHash(i, 7u));
    outputs[i].hash = uvec4(hash, floatBitsToUint(glintUniform(hash)), 0u, 0u);
}
)";

struct Input {
    Vector4f place, direction, normal;
};
struct Output {
    Vector4f pinhole, fisheye, spherical, place, back, refracted;
    Vector4u hash;
};

constexpr double u = 0x1p-24;
/// What Vulkan allows sines and cosines in [-pi, pi] to be off by.
constexpr double sine_error = 0x1p-11;
constexpr double exact_pi = 3.14159265358979323846;

double largest(const Vector3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

uint32_t hashOf(uint32_t x) {
    x = (x ^ x >> 16) * 0x85ebca6bu;
    x = (x ^ x >> 13) * 0xc2b2ae35u;
    return x ^ x >> 16;
}
uint32_t hashOf(uint32_t a, uint32_t b) { return hashOf(a * 0x9e3779b9u + hashOf(b + 0x7f4a7c15u)); }

class LensHelpers : public DeviceTest {
protected:
    std::vector<Output> run(const std::vector<Input>& inputs) { return runOnEach<Output>(device, shader, inputs); }
};

/// Places on the picture, directions, and surfaces that they meet from above.
std::vector<Input> randomInputs(size_t count) {
    // Poles, the picture's edge and its centre.
    const Vector3d special[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    Random random(5);
    std::vector<Input> inputs(count);
    for (size_t i = 0; i < count; i++) {
        Input& input = inputs[i];
        const bool is_special = i < std::size(special);
        const Vector3d direction = is_special ? special[i] : random.direction();
        Vector3d normal = random.direction();
        if (glm::dot(direction, normal) > 0.0) normal = -normal;
        input.place = Vector4d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.1, 2.0 * exact_pi),
                               random.uniform(0.4, 2.5));
        if (is_special) input.place = {0, 0, 1, 1};
        input.direction = Vector4d(direction, 0.0);
        input.normal = Vector4d(normal, 0.0);
    }
    return inputs;
}

}  // namespace

TEST_F(LensHelpers, AreWhatFloat64Gives) {
    const std::vector<Input> inputs = randomInputs(8192);
    const std::vector<Output> outputs = run(inputs);
    ASSERT_EQ(outputs.size(), inputs.size());
    uint32_t outside = 0, mirrored = 0;
    double lens_error = 0.0, place_error = 0.0;
    for (size_t i = 0; i < inputs.size(); i++) {
        const Output& output = outputs[i];
        const Vector2d place(Vector2f(inputs[i].place));
        const double angle = static_cast<double>(inputs[i].place.z);
        const auto check = [&](const Vector4f& actual, const Vector3d& exact, double bound) {
            const double error = largest(Vector3d(Vector3f(actual)) - exact);
            lens_error = std::max(lens_error, error);
            EXPECT_LE(error, bound) << i;
        };
        // A tangent is a quotient of sine and cosine, and counts as the direction is normalised: cos^2 of its error, at
        // most what the two are off by, for each of two components of up to sqrt(2).
        const double tangent = std::tan(0.5 * 0.45 * angle);
        check(output.pinhole, glm::normalize(Vector3d(place * tangent, -1.0)), 4.0 * sine_error);

        // An arc of up to pi, rounded three times, and a sine of up to 1 times a unit vector.
        const double radius = glm::length(place), off_axis = 0.5 * angle * radius;
        const bool is_outside = radius > 1.0;
        outside += is_outside;
        const Vector3d fisheye(radius > 0.0 ? place / radius * std::sin(off_axis) : place, -std::cos(off_axis));
        if (std::abs(radius - 1.0) > 4 * u)
            check(output.fisheye, is_outside ? Vector3d(0.0) : fisheye, is_outside ? 0.0 : sine_error + 32 * u);

        // A product of two.
        const double longitude = place.x * exact_pi, latitude = place.y * exact_pi / 2.0;
        check(output.spherical,
              {std::cos(latitude) * std::sin(longitude), std::sin(latitude), -std::cos(latitude) * std::cos(longitude)},
              2.1 * sine_error);

        // Arcs of tangents are off by 4096 units of 2^-23 of themselves: up to pi of 2 pi, and pi / 2 of pi.
        const Vector3d direction(Vector3f(inputs[i].direction));
        const Vector2d seen(0.5 - std::atan2(direction.y, direction.x) / (2.0 * exact_pi),
                            0.5 - std::atan2(direction.z, std::hypot(direction.x, direction.y)) / exact_pi);
        Vector2d difference = glm::abs(Vector2d(Vector2f(output.place)) - seen);
        difference.x = std::min(difference.x, 1.0 - difference.x);  // left and right edge are one
        if (std::hypot(direction.x, direction.y) == 0.0) difference.x = 0.0;
        place_error = std::max({place_error, difference.x, difference.y});
        EXPECT_LE(std::max(difference.x, difference.y), 0x1p-12 + 8 * u) << i;
        EXPECT_LE(largest(Vector3d(Vector3f(output.back)) - direction), 2.0 * exact_pi * 0x1p-12 + 2.1 * sine_error);

        // Snell: the part across the normal is scaled. k = 1 - eta^2 (1 - cos^2) is what rounding makes of a
        // difference, so its root, the part along the normal, is off by half of that over itself.
        const double eta = static_cast<double>(inputs[i].place.w);
        const Vector3d normal = glm::normalize(Vector3d(Vector3f(inputs[i].normal)));
        const double cosine = -glm::dot(normal, direction), k = 1.0 - eta * eta * (1.0 - cosine * cosine);
        const double k_error = (8.0 + 16.0 * eta * eta) * u;
        const Vector3d refracted(Vector3f(output.refracted));
        const double share = static_cast<double>(output.refracted.w);
        if (k < -k_error) {
            mirrored++;
            EXPECT_EQ(largest(refracted), 0.0);
            EXPECT_EQ(share, 1.0);
        } else if (k > 64.0 * k_error) {
            const double beyond = std::sqrt(k), beyond_error = k_error / beyond + 4 * u;
            EXPECT_LE(largest(glm::cross(normal, refracted) - eta * glm::cross(normal, direction)), 32 * u * eta);
            EXPECT_LE(std::abs(-glm::dot(normal, refracted) - beyond), beyond_error + 32 * u);
            const double across = (eta * cosine - beyond) / (eta * cosine + beyond);
            const double along = (cosine - eta * beyond) / (cosine + eta * beyond);
            // Of a quotient (a - b) / (a + b): twice the error of both over the sum; its square counts it twice.
            const double cosine_error = 8 * u;
            const double bound = 4.0 * (eta * cosine_error + beyond_error) / (eta * cosine + beyond) +
                                 4.0 * (cosine_error + eta * beyond_error) / (cosine + eta * beyond) + 16 * u;
            EXPECT_LE(std::abs(share - 0.5 * (across * across + along * along)), bound) << i;
        }
    }
    EXPECT_GT(outside, inputs.size() / 10);
    EXPECT_GT(mirrored, inputs.size() / 10);
    std::printf("lenses off by at most %.1e, places on a picture by %.1e\n", lens_error, place_error);
}

TEST_F(LensHelpers, HashesAreUniformAndTheSameEverywhere) {
    constexpr uint32_t count = 1u << 16;
    const std::vector<Output> outputs = run(std::vector<Input>(count));
    ASSERT_EQ(outputs.size(), count);
    double sum = 0.0, through = 0.0;
    uint32_t cells[16][16] = {};
    double last = 0.0, before = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t hash = hashOf(hashOf(i, 7));
        ASSERT_EQ(outputs[i].hash.x, hash);
        float value;
        std::memcpy(&value, &outputs[i].hash.y, sizeof value);
        ASSERT_EQ(value, static_cast<float>(hash >> 8) * 0x1p-24f);
        const double x = static_cast<double>(value);
        ASSERT_LT(x, 1.0);
        sum += x;
        if (i >= 1) cells[static_cast<int>(x * 16)][static_cast<int>(last * 16)]++;
        // Three layers, each there with a probability of 0.3.
        through += x >= 0.3 && last >= 0.3 && before >= 0.3 && i % 3 == 2;
        before = last;
        last = x;
    }
    // Five standard deviations: of a mean, of a share, and of chi squared with 255 degrees of freedom.
    EXPECT_NEAR(sum / count, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / count));
    const double share = std::pow(0.7, 3), layers = count / 3;
    EXPECT_NEAR(through / layers, share, 5.0 * std::sqrt(share * (1.0 - share) / layers));
    double chi = 0.0;
    for (const auto& row : cells)
        for (const uint32_t cell : row) chi += (cell - count / 256.0) * (cell - count / 256.0) / (count / 256.0);
    EXPECT_NEAR(chi, 255.0, 5.0 * std::sqrt(2.0 * 255.0));
}

}  // namespace glint::test
