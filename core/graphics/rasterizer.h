#pragma once

#include <glint/device/device.h>
#include <glint/math/camera.h>

#include <cstdint>
#include <memory>
#include <optional>

namespace glint {

class MeshGraphModel;

/// Draws triangles with compute shaders to a visibility buffer: the nearest triangle of each pixel, and its depth.
/// Shading comes after it, from shaders/raster/visibility.h. docs/rasterization.md has the rules and the errors.
///
///     Rasterizer rasterizer;
///     if (!rasterizer.create(device)) return 1;
///     Compute compute = device.createCompute();
///     rasterizer.begin(compute, {1600, 900});
///     rasterizer.draw(compute, {positions, 0, 12, indices, 0, triangles}, projection * view, 0);
///     ...                                 // a kernel that reads rasterizer.getVisibility()
///     if (!device.submit(compute)) return 1;
///     if (!rasterizer.check()) ...        // draw once more: the lists have grown
///
/// Which pixels a triangle covers is decided in whole numbers, so that triangles that share an edge leave no pixel of
/// it out and take none twice. Depth and triangle are written by one atomic maximum: pictures do not depend on the
/// order in which threads run, and are equal from run to run.
///
/// One thread may record draws of one rasterizer, and they are played in the order of the submissions. They set the
/// list's kernel, its uniform block and storage buffers from slot 0 on.
class Rasterizer {
public:
    using Where = std::source_location;

    /// Pixels along either side of a picture, at most.
    static constexpr uint32_t max_size = 16384;
    /// What getVisibility() has for a pixel without a triangle.
    static constexpr uint64_t background = 0;

    /// Which triangles are left out. Front faces are counter-clockwise on the picture.
    enum Cull : uint8_t { CullNone, CullBack, CullFront };

    /// What is written.
    enum Output : uint8_t {
        /// Depth and number of the nearest triangle: see getVisibility().
        OutputVisibility,
        /// How many triangles cover the pixel, near or far: front faces in the low word, back faces in the high one.
        OutputCounts,
    };

    /// How triangles are drawn.
    struct Options {
        Output output = OutputVisibility;
        /// Writes depth and number one after the other, by 32-bit atomics: what devices without FeatureAtomicBufferu64
        /// do anyway. The result is the same, to the bit.
        bool narrow = false;
        /// A triangle is drawn by one thread if the pixels around it are no more: 0 to 1024. Larger ones are divided
        /// into tiles. The result is the same. None: what suits the device.
        std::optional<uint32_t> small_pixels;
        /// Larger triangles, and cut ones, that one draw has room for to begin with; 16 to 2^22.
        uint32_t capacity = 1u << 15;
    };

    /// Triangles in buffers with FlagStorage.
    struct Mesh {
        Buffer positions;               ///< three floats each
        uint64_t position_offset = 0;   ///< bytes, a multiple of 4
        uint32_t position_stride = 12;  ///< bytes, a multiple of 4
        Buffer indices;                 ///< uint32_t, three for each triangle; null: 0, 1, 2, ...
        uint64_t index_offset = 0;      ///< bytes, a multiple of 4
        uint32_t triangles = 0;
    };

    /// The lists of the draws since the last check(), as it has found them.
    struct Statistics {
        uint64_t large = 0;     ///< places that the list of large triangles needed, in the draw that needed most
        uint64_t clipped = 0;   ///< triangles that had to be cut, likewise
        uint32_t capacity = 0;  ///< that each list had room for
        uint64_t memory = 0;    ///< bytes of the lists and the picture
    };

    /// Errors: "raster.options", "handle.null", those of kernels and buffers.
    Status create(const Device& device, const Options& options, Where where = Where::current());
    Status create(const Device& device, Where where = Where::current()) { return create(device, Options(), where); }
    /// True once create() has succeeded.
    explicit operator bool() const { return state_ != nullptr; }
    /// As given, with what was chosen.
    const Options& getOptions() const;

    /// Starts a picture without triangles, of 1x1 to 16384x16384 pixels whose 8 bytes each fit into one storage
    /// binding. Errors, which fail the list, as in all that follows: "raster.size", "handle.null" before create().
    void begin(Compute& compute, const Vector2u& size, Where where = Where::current());

    /// Triangle t has the number first_id + t; the last number is less than 2^32 - 1. The matrix goes from the mesh to
    /// clip space as in docs/conventions.md: what has 0 < z <= w is seen. Triangles of which a vertex is not finite, or
    /// not in the buffer, are left out. Errors: "raster.begin" (no picture has been begun), "raster.mesh" (offsets,
    /// strides, or a buffer that is too small, too large for one binding, or without FlagStorage), "raster.ids",
    /// "raster.matrix" (not finite).
    void draw(Compute& compute, const Mesh& mesh, const Matrix4x4f& clip_from_mesh, uint32_t first_id = 0,
              Cull cull = CullNone, Where where = Where::current());

    /// Clusters of instances, as MeshGraphSelector lists them. `instances`: Transform3x4 each, object to world. `list`:
    /// uvec2 each, x the instance, y the cluster; as many of them as the first uint of `count` says, or fit into the
    /// buffer. An entry that does not exist is left out. Triangle t of a cluster has the number
    ///
    ///     (instance * model.clusterCount() + cluster) * 128 + t
    ///
    /// Errors: those of draw(), "raster.ids" where instances * clusters * 128 exceeds 2^32 - 1, "raster.list" (buffers
    /// too small or too large, or without FlagStorage), those of a failed model.
    void drawClusters(Compute& compute, const MeshGraphModel& model, const Buffer& instances, const Buffer& list,
                      const Buffer& count, const CameraParameters& camera, Cull cull = CullNone,
                      Where where = Where::current());

    /// 64 bits a pixel, row after row from the top. High word: the bits of the float32 depth z / w, larger is nearer.
    /// Low word: ~number of the triangle; of equal depths the lowest number is kept. Null before begin(), which may
    /// replace it by a larger one.
    Buffer getVisibility() const;
    /// Of the picture that was begun last.
    Vector2u getSize() const;

    /// Waits for the device. "raster.capacity" if a list of a draw since the last check was too short: triangles are
    /// missing. The lists grow with the next begin(), as far as the device allows. "raster.tiles" if the tiles of
    /// one draw's large triangles were 2^32 or more, which no list holds.
    Status check(Where where = Where::current());
    Statistics getStatistics() const;

private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace glint
