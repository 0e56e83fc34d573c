#pragma once

#include <glint/device/device.h>
#include <glint/graphics/splat_model.h>
#include <glint/math/camera.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>

namespace glint {

/// Draws splats front to back with compute shaders: projects them, sorts those that are seen by depth, lists them for
/// each tile of the picture that they reach, and blends the tiles. docs/splatting.md has the model and its errors.
///
///     SplatRenderer renderer;
///     if (!renderer.create(device)) return 1;
///     Compute compute = device.createCompute();
///     renderer.draw(compute, camera, std::array{SplatRenderer::Instance{model}}, {color});
///     if (!device.submit(compute)) return 1;
///     if (!renderer.check()) ...  // draw once more: the lists have grown
///
/// Depth and order of a pixel's splats are those of their centres: by float32 view depth, ties by instance and then by
/// number, so that two draws of a scene are equal to the bit.
///
/// A renderer keeps its working memory from one draw to the next: at most 64 bytes for each splat of the instances, and
/// 16 for each entry of the tiles' lists. One thread may record draws of one renderer, and they are played in the order
/// of the submissions. Draws set the list's kernel, its uniform blocks, storage buffers and surface textures from slot
/// 0 on, and its push constants.
class SplatRenderer {
public:
    using Where = std::source_location;

    enum Method : uint8_t {
        MethodTiles,  ///< lists of the tiles that a splat's ellipse reaches, several pixels a thread
        /// Lists of the tiles in a square of three standard deviations, a pixel a thread, for comparison. What lies
        /// beyond the square in tiles that it does not reach is missing.
        MethodPlain,
    };

    /// How splats are drawn.
    struct Options {
        uint32_t tile_width = 0;  ///< 8, 16, 32 or 64 pixels; 0: what suits the device, and both then
        uint32_t tile_height = 0;
        /// That share a tile of MethodTiles: a power of two from 8 to 256, with at most 64 pixels each. From 32 on,
        /// when there have to be four for each column, all passes take the form for GPUs, which share more and wait for
        /// one another. 0: what suits the device.
        uint32_t threads = 0;
        float near = 0.2f;                 ///< splats whose centre has less view depth are left out; more than 0
        float alpha_cut = 1.0f / 255.0f;   ///< where its alpha is less a splat is left out; 1e-6 to 0.5
        float transmittance_stop = 1e-4f;  ///< a pixel ends once its transmittance is less; 0 to 0.5
        float low_pass = 0.3f;             ///< variance of the pixel filter, pixels^2; 0.01 to 100
        bool antialiased = false;          ///< Mip-Splatting's 2D filter: opacity falls as the low pass widens a splat
        uint32_t max_degree = 3;           ///< harmonics of higher degrees are left out
        Method method = MethodTiles;
        bool timed = false;  ///< take the times of the passes of each draw; needs FeatureTimestamps
    };

    /// A model in the world.
    struct Instance {
        SplatModel model;
        Matrix4x4f transform = Matrix4x4f(1.0f);  ///< affine and invertible, otherwise any
    };

    /// Textures with FlagSurface, all of one size.
    struct Outputs {
        /// RGBAu8n, RGBAf16 or RGBAf32. rgb: the sum of transmittance * alpha * color, that is premultiplied; a: 1 -
        /// transmittance. On a background: rgb + (1 - a) * background.
        Texture color;
        /// Rf32, optional: the mean view depth of the splats' centres, weighted as their colors; infinity where there
        /// is none.
        Texture depth;
        /// Rf32, optional.
        Texture transmittance;
    };

    /// What was drawn last, as check() has found it, and the working memory.
    struct Statistics {
        uint64_t splats = 0;           ///< of all instances
        uint64_t visible = 0;          ///< splats that reach a tile
        uint64_t entries = 0;          ///< that the tiles' lists would have, without a limit
        uint64_t capacity = 0;         ///< entries that there was room for
        uint64_t memory = 0;           ///< bytes of working memory, lists included; models not
        double bytes_per_splat = 0.0;  ///< of working memory without lists
    };

    enum Pass : uint8_t {
        PassProject,  ///< splats to the picture
        PassSort,     ///< by depth
        PassScatter,  ///< to the tiles
        PassGather,   ///< entries by tile
        PassBlend,
        PassCount,
    };
    /// "project", "sort", "scatter", "gather", "blend".
    static const char* toString(Pass pass);

    /// Errors: "splats.options", "device.unsupported" for times on a device without them, those of buffers and kernels.
    Status create(const Device& device, const Options& options, Where where = Where::current());
    Status create(const Device& device, Where where = Where::current()) { return create(device, Options(), where); }
    /// True once create() has succeeded.
    explicit operator bool() const { return state_ != nullptr; }
    /// As given, with the tile's size that was chosen.
    const Options& getOptions() const;

    /// Records all passes. The camera's aspect should be the picture's. Errors, which fail the list: "splats.output" (a
    /// texture that is missing, of another size, format or without FlagSurface), "splats.transform", "splats.too_many"
    /// (more splats than the device can sort), those of failed models, "handle.null" before create().
    void draw(Compute& compute, const Camera& camera, std::span<const Instance> instances, const Outputs& outputs,
              Where where = Where::current());

    /// Waits for the device. "splats.capacity" if the lists of a draw since the last check did not fit: its farthest
    /// splats are missing. The lists grow with the next draw, as far as the device allows.
    Status check(Where where = Where::current());
    Statistics getStatistics() const;
    /// Nanoseconds of each pass of the last draw; waits for it. Errors: "query.unused", "splats.options" if the
    /// renderer takes none.
    Expected<std::array<uint64_t, PassCount>> getTimes(Where where = Where::current()) const;

private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace glint
