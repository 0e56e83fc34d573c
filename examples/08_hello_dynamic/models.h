#pragma once

#include <glint/device/device.h>
#include <glint/math/camera.h>

#include <cstdint>
#include <vector>

/// 9 x 9 copies of a torus of 5,184 triangles. In every frame a kernel writes where their vertices are.
class Models {
public:
    static constexpr uint32_t grid = 9;
    static constexpr uint32_t count = grid * grid;
    static constexpr float ring = 1.0f;  ///< radius of the circle that the tube follows
    static constexpr float tube = 0.4f;
    static constexpr float pitch = 3.4f;     ///< from model to model
    static constexpr float floor_z = -1.9f;  ///< below all that models become

    /// How far the models are deformed at a moment: between 0, which is a torus, and `strongest`, as radians of twist a
    /// unit of length in the outer rows.
    static constexpr float strongest = 3.0f;
    static float amount(double time);
    /// The first moment at which they are deformed that far.
    static double timeOf(float amount);

    /// Makes buffers and the kernel; check error().
    explicit Models(glint::Device& device);
    const glint::Error& error() const { return error_; }

    /// Records the deformation.
    void deform(glint::Compute& compute, float amount, float time) const;
    /// Where the models stand at a moment, without their structures.
    static std::vector<glint::Tracing::Instance> instances(float time);
    static glint::Camera camera(float time, float aspect);
    static glint::Vector3f target() { return {0.5f, -2.3f, -1.0f}; }

    uint32_t vertices() const { return vertices_; }    ///< of a model
    uint32_t triangles() const { return triangles_; }  ///< of a model
    const glint::Buffer& vertexBuffer() const { return deformed_; }
    const glint::Buffer& indexBuffer() const { return indices_; }
    static constexpr uint32_t stride = 24;  ///< bytes: a position and a normal

private:
    glint::Error error_;
    glint::Kernel kernel_;
    glint::Buffer rest_, deformed_, indices_;
    uint32_t vertices_ = 0, triangles_ = 0;
};

/// The acceleration structures of the models: a bottom level each, and the top level of their instances.
class Structures {
public:
    /// Check error().
    Structures(glint::Device& device, const Models& models, glint::Tracing::Flags flags);
    const glint::Error& error() const { return error_; }

    // In a list, or queued before the next one.

    /// Refits the bottom levels to where the vertices are now, or builds them anew.
    void build(glint::Compute& compute, bool refit) const;
    glint::Status build(glint::Device& device, bool refit) const;
    /// Builds the top level of these instances, which get their structures.
    void buildScene(glint::Compute& compute, std::vector<glint::Tracing::Instance> instances) const;

    const glint::Tracing& scene() const { return scene_; }
    uint64_t memory() const;
    uint64_t scratchMemory() const;

private:
    glint::Error error_;
    std::vector<glint::Tracing> tracings_;
    // One for each structure, so that no build has to wait for another.
    std::vector<glint::Buffer> scratch_;
    glint::Tracing scene_;
    glint::Buffer scene_scratch_;
};
