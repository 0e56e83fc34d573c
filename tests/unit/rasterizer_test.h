#pragma once

// Triangles for Rasterizer, and what it makes of them.

#include "support/device_fixture.h"
#include "support/raster_reference.h"

#include <glint/graphics/rasterizer.h>

#include <bit>
#include <random>

namespace glint::test {

/// Triangles of which three successive positions, or those that three indices name, are the corners.
struct Triangles {
    std::vector<Vector3f> positions;
    std::vector<uint32_t> indices;
    uint32_t count() const { return static_cast<uint32_t>((indices.empty() ? positions.size() : indices.size()) / 3); }
    void add(const Vector3f& a, const Vector3f& b, const Vector3f& c) { positions.insert(positions.end(), {a, b, c}); }
};

class RasterizerTest : public DeviceTest {
protected:
    static Rasterizer::Options counting() {
        Rasterizer::Options options;
        options.output = Rasterizer::OutputCounts;
        return options;
    }

    Rasterizer create(const Rasterizer::Options& options = {}) {
        Rasterizer rasterizer;
        EXPECT_THAT(rasterizer.create(device, options), IsOk());
        return rasterizer;
    }

    Rasterizer::Mesh upload(const Triangles& triangles) {
        Rasterizer::Mesh mesh;
        mesh.positions = device.createBuffer(Buffer::FlagStorage | Buffer::FlagVertex, std::span(triangles.positions));
        if (!triangles.indices.empty())
            mesh.indices = device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndex, std::span(triangles.indices));
        mesh.triangles = triangles.count();
        return mesh;
    }

    /// The picture's words; a list that was too short is a failure.
    std::vector<uint64_t> read(Rasterizer& rasterizer) {
        EXPECT_THAT(rasterizer.check(), IsOk());
        const Vector2u size = rasterizer.getSize();
        const auto pixels = device.read<uint64_t>(rasterizer.getVisibility(), 0, uint64_t{size.x} * size.y);
        EXPECT_THAT(pixels, IsOk());
        return pixels ? *pixels : std::vector<uint64_t>(size_t{size.x} * size.y);
    }

    std::vector<uint64_t> draw(Rasterizer& rasterizer, const Rasterizer::Mesh& mesh, const Vector2u& size,
                               const Matrix4x4f& matrix = Matrix4x4f(1.0f),
                               Rasterizer::Cull cull = Rasterizer::CullNone) {
        Compute compute = device.createCompute();
        rasterizer.begin(compute, size);
        rasterizer.draw(compute, mesh, matrix, 0, cull);
        EXPECT_THAT(device.submit(compute), IsOk());
        return read(rasterizer);
    }
    std::vector<uint64_t> draw(Rasterizer& rasterizer, const Triangles& triangles, const Vector2u& size,
                               const Matrix4x4f& matrix = Matrix4x4f(1.0f),
                               Rasterizer::Cull cull = Rasterizer::CullNone) {
        return draw(rasterizer, upload(triangles), size, matrix, cull);
    }
};

inline float depthOf(uint64_t pixel) { return std::bit_cast<float>(static_cast<uint32_t>(pixel >> 32)); }
inline uint32_t triangleOf(uint64_t pixel) { return ~static_cast<uint32_t>(pixel); }

/// A random number in [low, high).
inline float between(std::mt19937& random, float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 8) * 0x1p-24f;
}

}  // namespace glint::test
