// Rasterizer: which pixels triangles cover, and how deep, against whole numbers, float64 and the driver's pipeline.

#include "rasterizer_test.h"

#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace glint::test {

namespace {

/// Triangles of all sizes and shapes with corners on the lattice of 1/256 pixel, many of them on pixels' centres and on
/// each other, in clip space with w = 1. The picture's sides are powers of two, so that nothing is rounded on the way.
Triangles latticeTriangles(const Vector2u& size, uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    Triangles triangles;
    const auto corner = [&](int x, int y, int reach) {
        const auto place = [&](int middle) {
            int at = middle + static_cast<int>(random() % (2u * reach + 1)) - reach;
            // Every other one on a line of centres.
            if (random() % 2 == 0) at = at / 256 * 256 + 128;
            return at;
        };
        const Vector2f half = Vector2f(size) * 128.0f;
        return Vector3f((static_cast<float>(place(x)) - half.x) / half.x,
                        (half.y - static_cast<float>(place(y))) / half.y, between(random, 0.1f, 0.9f));
    };
    for (uint32_t i = 0; i < count; i++) {
        const int reach = 1 << random() % 19;
        const int x = static_cast<int>(random() % (size.x * 256)), y = static_cast<int>(random() % (size.y * 256));
        triangles.add(corner(x, y, reach), corner(x, y, reach), corner(x, y, reach));
    }
    return triangles;
}

FixedTriangle fixedTriangle(const Triangles& triangles, uint32_t t, const Vector2u& size) {
    FixedTriangle fixed;
    for (uint32_t k = 0; k < 3; k++) {
        const uint32_t corner = triangles.indices.empty() ? 3 * t + k : triangles.indices[3 * t + k];
        fixed[k] = fixedCorner(triangles.positions[corner], size);
    }
    return fixed;
}

std::vector<uint64_t> referenceCounts(const Triangles& triangles, const Vector2u& size) {
    std::vector<uint64_t> counts(size_t{size.x} * size.y);
    for (uint32_t t = 0; t < triangles.count(); t++) {
        const FixedTriangle fixed = fixedTriangle(triangles, t, size);
        const uint64_t one = areaSign(fixed) < 0 ? 1 : 1ull << 32;
        forEachPixel(fixed, size, [&](uint32_t x, uint32_t y, double) { counts[size_t{y} * size.x + x] += one; });
    }
    return counts;
}

size_t differences(const std::vector<uint64_t>& a, const std::vector<uint64_t>& b) {
    size_t count = a.size() == b.size() ? 0 : a.size() + b.size();
    for (size_t i = 0; i < std::min(a.size(), b.size()); i++) count += a[i] != b[i];
    return count;
}

/// An infinite reversed projection with its near plane at `near`.
Matrix4x4f perspective(float fov, float aspect, float near) {
    return Camera().perspective(fov, aspect, near).projection();
}

std::vector<ClipTriangle> inClipSpace(const Triangles& triangles, const Matrix4x4f& matrix) {
    std::vector<ClipTriangle> clip;
    for (uint32_t t = 0; t < triangles.count(); t++)
        for (uint32_t k = 0; k < 3; k++) {
            if (k == 0) clip.emplace_back();
            const uint32_t corner = triangles.indices.empty() ? 3 * t + k : triangles.indices[3 * t + k];
            clip.back()[k] = Matrix4x4d(matrix) * Vector4d(triangles.positions[corner], 1.0);
        }
    return clip;
}

/// Random triangles before, around and behind a camera that looks along -Z.
Triangles spaceTriangles(uint32_t count, uint32_t seed, float reach, float z_low, float z_high) {
    std::mt19937 random(seed);
    Triangles triangles;
    for (uint32_t i = 0; i < count; i++) {
        const auto corner = [&] {
            return Vector3f(between(random, -reach, reach), between(random, -reach, reach),
                            between(random, z_low, z_high));
        };
        triangles.add(corner(), corner(), corner());
    }
    return triangles;
}

/// Every pixel's counts within what float64 says, and how near to an edge those are that are not exactly it.
void expectCounts(const std::vector<uint64_t>& counts, const ExpectedCounts& expected, const char* what) {
    size_t wrong = 0, mismatches = 0, covered = 0;
    double farthest = 0.0;
    for (size_t i = 0; i < counts.size(); i++) {
        const ExpectedCounts::Pixel& pixel = expected.pixels[i];
        bool differs = false;
        for (int side = 0; side < 2; side++) {
            const auto count = static_cast<uint32_t>(counts[i] >> (32 * side));
            wrong += count < pixel.sure[side] || count > pixel.sure[side] + pixel.doubtful[side];
            differs = differs || count != pixel.inside[side];
            covered += count;
        }
        if (!differs) continue;
        mismatches++;
        farthest = std::max(farthest, pixel.distance);
    }
    std::printf(
        "%s: %zu pixels of triangles, %zu other than by float64, the farthest %.3g * 2^-8 pixels from an edge\n", what,
        covered, mismatches, farthest * 256);
    EXPECT_EQ(wrong, 0u) << what;
}

/// Everywhere one more front than back faces, or the other way round.
void expectOnce(const std::vector<uint64_t>& counts, int expected, const std::string& what) {
    size_t wrong = 0;
    for (const uint64_t count : counts)
        wrong += static_cast<int>(static_cast<uint32_t>(count)) - static_cast<int>(count >> 32) != expected;
    EXPECT_EQ(wrong, 0u) << what << ": pixels that are not covered once";
}

}  // namespace

TEST_F(RasterizerTest, CoversExactlyWhatTheRulesSay) {
    Rasterizer rasterizer = create(counting());
    for (const Vector2u size : {Vector2u(64, 64), Vector2u(1, 1), Vector2u(256, 16)}) {
        const Triangles triangles = latticeTriangles(size, 1500, size.x);
        const std::vector<uint64_t> counts = draw(rasterizer, triangles, size);
        EXPECT_EQ(differences(counts, referenceCounts(triangles, size)), 0u) << size.x << "x" << size.y;
    }
    // Sides that are no powers of two: ndc is rounded, and the rule says how.
    for (const Vector2u size : {Vector2u(17, 3), Vector2u(8191, 5)}) {
        std::mt19937 random(size.x);
        Triangles triangles;
        for (int i = 0; i < 2000; i++) {
            const float reach = std::exp2(between(random, -12.0f, 1.0f));
            const Vector2f middle(between(random, -1, 1), between(random, -1, 1));
            const auto corner = [&] {
                return Vector3f(middle.x + between(random, -reach, reach), middle.y + between(random, -reach, reach),
                                0.5f);
            };
            triangles.add(corner(), corner(), corner());
        }
        const std::vector<uint64_t> counts = draw(rasterizer, triangles, size);
        EXPECT_EQ(differences(counts, referenceCounts(triangles, size)), 0u) << size.x << "x" << size.y;
    }
}

TEST_F(RasterizerTest, GivesTheSameInEachForm) {
    const Vector2u size(256, 256);
    const Rasterizer::Mesh mesh = upload(latticeTriangles(size, 2000, 7));
    Rasterizer rasterizer = create();
    const std::vector<uint64_t> expected = draw(rasterizer, mesh, size);
    EXPECT_EQ(std::count(expected.begin(), expected.end(), Rasterizer::background), 0);
    for (const bool narrow : {false, true})
        for (const uint32_t small : {0u, 16u, 1024u}) {
            Rasterizer::Options options;
            options.narrow = narrow;
            options.small_pixels = small;
            Rasterizer other = create(options);
            EXPECT_EQ(differences(draw(other, mesh, size), expected), 0u) << narrow << " " << small;
        }
}

TEST_F(RasterizerTest, GivesTheSameAHundredTimes) {
    const Vector2u size(128, 128);
    Triangles triangles = latticeTriangles(size, 600, 8);
    // Equal depths, so that only the number decides, and once more in another order.
    for (Vector3f& p : triangles.positions) p.z = 0.5f;
    const Rasterizer::Mesh mesh = upload(triangles);
    Rasterizer rasterizer = create();
    const std::vector<uint64_t> expected = draw(rasterizer, mesh, size);
    for (int i = 1; i < 100; i++) ASSERT_EQ(differences(draw(rasterizer, mesh, size), expected), 0u) << i;
    std::vector<uint32_t> lowest(expected.size(), ~0u);
    for (uint32_t t = triangles.count(); t-- > 0;)
        forEachPixel(fixedTriangle(triangles, t, size), size,
                     [&](uint32_t x, uint32_t y, double) { lowest[size_t{y} * size.x + x] = t; });
    for (size_t i = 0; i < lowest.size(); i++) ASSERT_EQ(triangleOf(expected[i]), lowest[i]) << i;
}

// |depth - exact| <= 2^-24 (depth_a + 14 S) with S = |slope_x offset_x| + |slope_y offset_y|, in which each product
// of the slope counts by its magnitude: docs/rasterization.md.
TEST_F(RasterizerTest, DepthIsWithinItsBound) {
    const Vector2u size(64, 64);
    Rasterizer rasterizer = create();
    const Triangles triangles = latticeTriangles(size, 400, 9);
    double worst = 0.0, largest = 0.0;
    for (uint32_t t = 0; t < triangles.count(); t++) {
        Triangles one;
        one.add(triangles.positions[3 * t], triangles.positions[3 * t + 1], triangles.positions[3 * t + 2]);
        const std::vector<uint64_t> pixels = draw(rasterizer, one, size);
        const FixedTriangle fixed = fixedTriangle(one, 0, size);
        const auto& [a, b, c] = fixed;
        const double ab_x = static_cast<double>(b.x - a.x), ab_y = static_cast<double>(b.y - a.y);
        const double ac_x = static_cast<double>(c.x - a.x), ac_y = static_cast<double>(c.y - a.y);
        const double area = std::abs(ab_x * ac_y - ab_y * ac_x);
        const double rise_b = std::abs(b.depth - a.depth), rise_c = std::abs(c.depth - a.depth);
        size_t covered = 0;
        forEachPixel(fixed, size, [&](uint32_t x, uint32_t y, double exact) {
            covered++;
            const double offset_x = std::abs(x * 256.0 + 128 - static_cast<double>(a.x));
            const double offset_y = std::abs(y * 256.0 + 128 - static_cast<double>(a.y));
            const double sum = ((rise_b * std::abs(ac_y) + rise_c * std::abs(ab_y)) * offset_x +
                                (rise_c * std::abs(ab_x) + rise_b * std::abs(ac_x)) * offset_y) /
                               area;
            const double bound = 0x1p-24 * (a.depth + 14 * sum);
            const double error = std::abs(depthOf(pixels[size_t{y} * size.x + x]) - exact);
            worst = std::max(worst, error / bound);
            largest = std::max(largest, error);
            ASSERT_LE(error, bound) << t;
            ASSERT_EQ(triangleOf(pixels[size_t{y} * size.x + x]), 0u);
        });
        ASSERT_EQ(static_cast<size_t>(std::count_if(pixels.begin(), pixels.end(), [](uint64_t p) { return p != 0; })),
                  covered);
    }
    std::printf("depth: at most %.2f of its bound, %.3g\n", worst, largest);
}

TEST_F(RasterizerTest, AgreesWithFloat64BehindTheEyeAndFarAway) {
    const Vector2u size(128, 96);
    Rasterizer rasterizer = create(counting());
    // Rounding to the lattice moves a corner by 2^-9 pixels each way, so an edge by 2^-8.5; float32 by what is left to
    // 2^-8 as long as corners are within 2^11 pixels: 2^-24 * 2 * 2^11 = 2^-12. Beyond, corners are cut by pairs of
    // floats, or are off by as much as 2^-8 at 2^15 pixels.
    struct Case {
        const char* what;
        float reach, z_low, z_high, near;
        double tolerance;
    };
    for (const Case& c : {Case{"before the near plane", 2.0f, -4.0f, -0.6f, 0.5f, 0x1p-8},
                          Case{"through the near plane", 2.0f, -4.0f, 3.0f, 0.5f, 0x1p-8},
                          Case{"through a close near plane", 20.0f, -40.0f, 30.0f, 0.001f, 0x1.8p-8},
                          Case{"large", 1000.0f, -100.0f, 60.0f, 0.1f, 0x1.8p-8}}) {
        const Triangles triangles = spaceTriangles(800, 11, c.reach, c.z_low, c.z_high);
        const Matrix4x4f matrix = perspective(70.0f, 4.0f / 3.0f, c.near);
        const std::vector<uint64_t> counts = draw(rasterizer, triangles, size, matrix);
        expectCounts(counts, ExpectedCounts(inClipSpace(triangles, matrix), size, c.tolerance), c.what);
    }
    EXPECT_GT(rasterizer.getStatistics().clipped, 200u);
}

TEST_F(RasterizerTest, CutTrianglesCoverEachPixelOnce) {
    // From within a closed surface, wherever the corners are: behind the eye, beyond what fixed point holds, or nearer
    // than the near plane would be, if it were in the picture.
    const Vector2u size(160, 120);
    Rasterizer rasterizer = create(counting());
    std::mt19937 random(12);
    uint64_t clipped = 0;
    for (int i = 0; i < 60; i++) {
        Triangles triangles;
        const Mesh mesh = i % 3 == 0 ? createBox({1, 1, 1}) : createSphere(1.0f, static_cast<uint32_t>(i % 5));
        const float stretch = std::exp2(between(random, 0.0f, 12.0f));
        for (const Vector3f& p : mesh.positions) triangles.positions.push_back(p * Vector3f(1.0f, stretch, 2.0f));
        triangles.indices = mesh.indices;
        glm::quat turn(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1), between(random, -1, 1));
        turn = glm::normalize(turn);
        const Vector3f eye = Vector3f(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)) * 0.2f;
        const Matrix4x4f matrix = perspective(80.0f, 4.0f / 3.0f, 0.01f) * glm::mat4_cast(turn) * translate(-eye);
        expectOnce(draw(rasterizer, triangles, size, matrix), -1, "surface " + std::to_string(i));
        clipped += rasterizer.getStatistics().clipped;
    }
    EXPECT_GT(clipped, 500u);
}

TEST_F(RasterizerTest, CutTrianglesWithCornersOnCentres) {
    // Wheels: a hub and its rim on pixels' centres, and around them triangles that reach beyond what fixed point holds,
    // so that polygons with corners and level edges on lines of centres are what is left of them.
    const Vector2u size(64, 64);
    const auto centre = [](int pixel) { return (static_cast<float>(pixel) + 0.5f) / 32.0f - 1.0f; };
    Rasterizer rasterizer = create(counting());
    std::mt19937 random(21);
    uint64_t clipped = 0;
    for (int i = 0; i < 60; i++) {
        Triangles wheel;
        const int x = 24 + static_cast<int>(random() % 16), y = 24 + static_cast<int>(random() % 16);
        wheel.positions.emplace_back(centre(x), centre(y), 0.5f);
        // Eight directions, of which every second one is along a line of centres.
        for (int k = 0; k < 8; k++) {
            const int dx = k % 4 == 2 ? 0 : k < 2 || k > 6 ? 1 : -1, dy = k % 4 == 0 ? 0 : k < 4 ? 1 : -1;
            const int reach = 1 + static_cast<int>(random() % 16);
            wheel.positions.emplace_back(centre(x + dx * reach), centre(y + dy * reach), 0.5f);
            const float far = between(random, 3000.0f, 9000.0f);
            wheel.positions.emplace_back(centre(x) + static_cast<float>(dx) * far,
                                         centre(y) + static_cast<float>(dy) * far, 0.5f);
        }
        for (uint32_t k = 0; k < 8; k++) {
            const uint32_t rim = 1 + 2 * k, next = 1 + 2 * ((k + 1) % 8);
            wheel.indices.insert(wheel.indices.end(), {0, rim, next});
            if (random() % 2 == 0)
                wheel.indices.insert(wheel.indices.end(), {rim, rim + 1, next + 1, rim, next + 1, next});
            else
                wheel.indices.insert(wheel.indices.end(), {rim, rim + 1, next, rim + 1, next + 1, next});
        }
        expectOnce(draw(rasterizer, wheel, size), 1, "wheel " + std::to_string(i));
        clipped += rasterizer.getStatistics().clipped;
    }
    EXPECT_EQ(clipped, 60u * 16u);
}

namespace {

/// A grid of cells over [-1.1, 1.1]^2 whose corners are moved by up to `jitter` cells, with random diagonals.
Triangles jitteredGrid(uint32_t columns, uint32_t rows, float jitter, uint32_t seed) {
    std::mt19937 random(seed);
    Triangles triangles;
    for (uint32_t y = 0; y <= rows; y++)
        for (uint32_t x = 0; x <= columns; x++) {
            const bool is_border = x == 0 || y == 0 || x == columns || y == rows;
            const float reach = is_border ? 0.0f : jitter;
            const auto at = [&](uint32_t i, uint32_t count) {
                return 2.2f * (static_cast<float>(i) + between(random, -reach, reach)) / static_cast<float>(count) -
                       1.1f;
            };
            const float px = at(x, columns), py = at(y, rows);
            triangles.positions.emplace_back(px, py, 0.5f);
        }
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < columns; x++) {
            const uint32_t a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
            if (random() % 2 == 0)
                triangles.indices.insert(triangles.indices.end(), {a, b, d, a, d, c});
            else
                triangles.indices.insert(triangles.indices.end(), {a, b, c, b, d, c});
        }
    return triangles;
}

/// Two triangles over the picture, of which random ones are divided into three again and again.
Triangles dividedTriangles(uint32_t divisions, uint32_t seed) {
    std::mt19937 random(seed);
    Triangles triangles;
    triangles.positions = {{-1.5f, -1.5f, 0.5f}, {1.5f, -1.5f, 0.5f}, {1.5f, 1.5f, 0.5f}, {-1.5f, 1.5f, 0.5f}};
    triangles.indices = {0, 1, 2, 0, 2, 3};
    for (uint32_t i = 0; i < divisions; i++) {
        const size_t t = random() % (triangles.indices.size() / 3);
        const uint32_t a = triangles.indices[3 * t], b = triangles.indices[3 * t + 1], c = triangles.indices[3 * t + 2];
        float u = between(random, 0, 1), v = between(random, 0, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const auto d = static_cast<uint32_t>(triangles.positions.size());
        triangles.positions.push_back(triangles.positions[a] * (1 - u - v) + triangles.positions[b] * u +
                                      triangles.positions[c] * v);
        triangles.indices[3 * t + 2] = d;
        triangles.indices.insert(triangles.indices.end(), {b, c, d, c, a, d});
    }
    return triangles;
}

/// Spokes from a point within the picture to a circle around it, at random angles.
Triangles fan(uint32_t spokes, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<float> angles(spokes);
    for (float& angle : angles) angle = between(random, 0, 2 * std::numbers::pi_v<float>);
    // So that no triangle is half a turn wide.
    for (uint32_t i = 0; i < 8; i++) angles[i] = static_cast<float>(i) * std::numbers::pi_v<float> / 4;
    std::sort(angles.begin(), angles.end());
    Triangles triangles;
    triangles.positions.emplace_back(between(random, -0.9f, 0.9f), between(random, -0.9f, 0.9f), 0.5f);
    for (uint32_t i = 0; i < spokes; i++) {
        triangles.positions.emplace_back(4 * std::cos(angles[i]), 4 * std::sin(angles[i]), 0.5f);
        triangles.indices.insert(triangles.indices.end(), {0, i + 1, (i + 1) % spokes + 1});
    }
    return triangles;
}

}  // namespace

TEST_F(RasterizerTest, SharedEdgesBelongToOneTriangle) {
    Rasterizer rasterizer = create(counting());
    size_t triangles = 0;
    const auto expectEach = [&](const Triangles& mesh, const Vector2u& size, const std::string& what) {
        triangles += mesh.count();
        expectOnce(draw(rasterizer, mesh, size), 1, what);
    };
    expectEach(jitteredGrid(707, 707, 0.45f, 1), {1024, 768}, "a million small triangles");
    expectEach(jitteredGrid(40, 40, 0.45f, 2), {1024, 768}, "triangles of 20 pixels");
    expectEach(jitteredGrid(3, 3, 0.3f, 3), {1024, 768}, "triangles of 300 pixels");
    expectEach(jitteredGrid(4000, 3, 0.45f, 4), {300, 200}, "upright slivers");
    expectEach(jitteredGrid(2, 4000, 0.45f, 5), {300, 200}, "lying slivers");
    expectEach(dividedTriangles(20000, 6), {300, 200}, "divided triangles");
    for (uint32_t i = 0; i < 10; i++) expectEach(fan(20 << i % 5, 7 + i), {128, 128}, "fan " + std::to_string(i));
    EXPECT_GT(triangles, 1000000u);
}

namespace {

class RasterizerDriverTest : public RasterizerTest {
protected:
    /// How many triangles the driver's own pipeline draws at each pixel, front faces in the low word.
    std::vector<uint64_t> drawByDriver(const Triangles& triangles, const Vector2u& size, const Matrix4x4f& matrix) {
        std::vector<uint64_t> counts(size_t{size.x} * size.y);
        const Rasterizer::Mesh mesh = upload(triangles);
        for (const bool is_back : {false, true}) {
            const Texture texture = device.createTexture2D(FormatRf32, size.x, size.y, Texture::FlagTarget);
            Target target = device.createTarget();
            target.setColorTexture(0, texture);
            target.setClearColor({0, 0, 0, 0});
            Pipeline pipeline = device.createPipeline();
            pipeline.createShaderGLSL(Shader::TypeVertex, "layout(location = 0) in vec3 p;\n"
                                                          "layout(push_constant) uniform C { mat4 matrix; } c;\n"
                                                          "void main() { gl_Position = c.matrix * vec4(p, 1.0); }\n");
            pipeline.createShaderGLSL(Shader::TypeFragment,
                                      "layout(location = 0) out float count;\nvoid main() { count = 1.0; }\n");
            pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12);
            pipeline.setColorFormat(FormatRf32);
            pipeline.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
            pipeline.setCullMode(is_back ? Pipeline::CullModeFront : Pipeline::CullModeBack);
            EXPECT_THAT(pipeline.create(), IsOk());
            Command command = device.createCommand(target);
            command.setPipeline(pipeline);
            command.setVertexBuffer(0, mesh.positions);
            command.setPushConstants(matrix);
            command.drawArrays(mesh.triangles * 3);
            EXPECT_THAT(device.submit(command), IsOk());
            std::vector<float> values(counts.size());
            EXPECT_THAT(device.getTexture(texture, values.data(), values.size() * 4), IsOk());
            for (size_t i = 0; i < counts.size(); i++)
                counts[i] += static_cast<uint64_t>(values[i]) << (is_back ? 32 : 0);
        }
        return counts;
    }

    void expectAgreement(const Triangles& triangles, const Vector2u& size, const Matrix4x4f& matrix, const char* what) {
        Rasterizer rasterizer = create(counting());
        const std::vector<uint64_t> ours = draw(rasterizer, triangles, size, matrix);
        const std::vector<uint64_t> theirs = drawByDriver(triangles, size, matrix);
        const ExpectedCounts expected(inClipSpace(triangles, matrix), size, 0x1p-8);
        size_t mismatches = 0, covered = 0;
        for (size_t i = 0; i < ours.size(); i++) {
            covered += static_cast<uint32_t>(theirs[i]) + (theirs[i] >> 32);
            if (ours[i] == theirs[i]) continue;
            mismatches++;
            const ExpectedCounts::Pixel& pixel = expected.pixels[i];
            std::printf("  pixel %zu, %zu: ours %u + %u, theirs %u + %u, an edge at %.3f * 2^-8 pixels\n", i % size.x,
                        i / size.x, static_cast<uint32_t>(ours[i]), static_cast<uint32_t>(ours[i] >> 32),
                        static_cast<uint32_t>(theirs[i]), static_cast<uint32_t>(theirs[i] >> 32), pixel.distance * 256);
            const auto difference = [&](int side) {
                const auto a = static_cast<int>(ours[i] >> (32 * side) & 0xffffffffu);
                const auto b = static_cast<int>(theirs[i] >> (32 * side) & 0xffffffffu);
                return static_cast<uint32_t>(std::abs(a - b));
            };
            EXPECT_LE(difference(0), pixel.doubtful[0]) << what;
            EXPECT_LE(difference(1), pixel.doubtful[1]) << what;
        }
        std::printf("%s: %u triangles, %zu pixels of them, %zu other than the driver's\n", what, triangles.count(),
                    covered, mismatches);
        EXPECT_GT(covered, 1000u);
    }
};

}  // namespace

TEST_F(RasterizerDriverTest, CoversWhatTheDriverCovers) {
    const Vector2u size(200, 150);
    const Matrix4x4f matrix = perspective(70.0f, 4.0f / 3.0f, 0.5f);
    expectAgreement(spaceTriangles(400, 21, 3.0f, -6.0f, -0.6f), size, matrix, "large triangles");
    std::mt19937 random(22);
    Triangles small;
    for (int i = 0; i < 15000; i++) {
        const Vector3f middle(between(random, -4, 4), between(random, -3, 3), between(random, -5, -3));
        const auto corner = [&] {
            return middle + Vector3f(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)) * 0.08f;
        };
        small.add(corner(), corner(), corner());
    }
    expectAgreement(small, size, matrix, "small triangles");
    expectAgreement(latticeTriangles({256, 128}, 1000, 23), {256, 128}, Matrix4x4f(1.0f), "corners on the lattice");
    // Cut at the near plane, which is in the picture.
    expectAgreement(spaceTriangles(400, 24, 2.0f, -4.0f, 2.0f), size, matrix, "through the near plane");
}

}  // namespace glint::test
