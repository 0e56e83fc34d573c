#pragma once

// What the example shows: splats of files, or of meshes that it lights itself.

#include <glint/device/device.h>
#include <glint/format/splats.h>
#include <glint/math/camera.h>

#include <filesystem>
#include <span>
#include <vector>

/// Models of splats and where they stand. Z is up; what is to be seen is about 1.5 units wide and around the origin.
struct SplatScene {
    std::vector<glint::Splats> models;
    std::vector<glint::Matrix4x4f> transforms;

    uint64_t size() const;

    /// The models of files, brought to one size and side by side.
    static glint::Expected<SplatScene> load(std::span<const std::filesystem::path> files);
    /// The mesh of a file, or a torus if `mesh` is empty, on a round floor, with balls around it: three models of
    /// `count` splats together, each with the shadows of all. The device casts the rays for them.
    static glint::Expected<SplatScene> bake(const glint::Device& device, const std::filesystem::path& mesh,
                                            uint32_t count);

    /// Goes round the origin by 8 degrees a second, nearer and farther.
    static glint::Camera camera(float time, float fov, float aspect);
};
