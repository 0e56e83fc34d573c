#pragma once

// What a device draws of splats, as the float64 reference gives it.

#include "support/splat_reference.h"
#include "support/splat_scenes.h"

#include <glint/device/device.h>
#include <glint/format/image.h>
#include <glint/graphics/splat_renderer.h>

#include <span>

namespace glint::test {

/// The reference's settings for a renderer's options, cut-offs included.
SplatSettings settingsOf(const SplatRenderer::Options& options);

/// A renderer and textures to draw into, RGBAf32 unless said otherwise. Throws std::runtime_error with what went wrong.
class SplatDrawer {
public:
    explicit SplatDrawer(const Device& device, const SplatRenderer::Options& options = {},
                         Format color = FormatRGBAf32);

    /// Draws, once more for each time that the lists have to grow, and waits.
    void draw(const Camera& camera, uint32_t width, uint32_t height,
              std::span<const SplatRenderer::Instance> instances);
    void draw(const SplatScene& scene, const SplatModel& model);
    /// Draws a scene and reads it back.
    SplatPicture draw(const SplatScene& scene, SplatModel::Storage storage);

    /// All that was drawn last.
    SplatPicture picture();
    Image colors();

    const SplatRenderer& renderer() const { return renderer_; }
    /// The reference's, for the same picture.
    SplatSettings settings() const { return settingsOf(renderer_.getOptions()); }

private:
    Device device_;
    Format format_;
    SplatRenderer renderer_;
    SplatRenderer::Outputs outputs_;
};

/// Splats of a mesh: a torus over a floor, with shadows that the device's rays find. `quality` is the number of rays
/// from each splat to the sky.
SplatScene meshScene(const Device& device, uint32_t count, uint32_t quality, uint32_t width, uint32_t height);

/// The reference's picture of a scene: of what the storage holds, or of the scene itself.
SplatPicture referenceOf(const SplatScene& scene, const SplatSettings& settings);
SplatPicture referenceOf(const SplatScene& scene, SplatModel::Storage storage, const SplatSettings& settings);

}  // namespace glint::test
