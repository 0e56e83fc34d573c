#pragma once

#include <glint/device/device.h>
#include <glint/format/splats.h>

#include <cstdint>
#include <span>
#include <vector>

namespace glint {

/// Splats on a device, as SplatRenderer draws them.
///
///     SplatModel model(device, splats);
///     renderer.draw(compute, camera, std::array{SplatRenderer::Instance{model}}, {color});
///
/// A value: copies share the buffers. Like a handle it carries its first error, of which the device's message callback
/// is told; drawing a failed model fails.
class SplatModel {
public:
    using Where = std::source_location;

    /// What a splat takes, with n = coefficientCount(). Positions, scales and opacities are float32 in both.
    enum Storage : uint8_t {
        StorageHalf,   ///< rotations of 16 bits a component, harmonics in float16: 36 + 6n bytes, 132 at degree 3
        StorageFloat,  ///< all in float32: 44 + 12n bytes
    };

    /// A part of the splats: at most what one storage binding holds. Words of 32 bits, value by value and for each
    /// value splat by splat: 3 of the position, 3 of the scale, the opacity, the quaternion (StorageHalf: 2 words of
    /// two signed normalised numbers each; else 4), the harmonics (StorageHalf: two in a word, the last word padded
    /// with 0).
    struct Chunk {
        Buffer buffer;
        uint32_t first = 0;
        uint32_t size = 0;
    };

    SplatModel() = default;
    /// This is create(); the error is carried.
    SplatModel(const Device& device, const Splats& splats, Storage storage = StorageHalf,
               Where where = Where::current());

    /// Encodes and uploads, anew if there was something; a model without splats draws nothing. Errors: those of
    /// Splats::validate and Device::createBuffer, "splats.too_many" (more than 2^32 - 1), "splats.out_of_memory".
    Status create(const Device& device, const Splats& splats, Storage storage = StorageHalf,
                  Where where = Where::current());

    /// True once created without an error.
    explicit operator bool() const { return device_ && !error_; }
    /// Why the model failed; "handle.null" before create().
    Error error() const;

    uint32_t size() const { return size_; }
    /// Of the harmonics, 0 to 3.
    uint32_t getDegree() const { return degree_; }
    Storage getStorage() const { return storage_; }
    /// Bytes on the device.
    uint64_t getMemory() const;
    /// The box of the centres.
    const BoundBox& getBounds() const { return bounds_; }
    std::span<const Chunk> getChunks() const { return chunks_; }

    /// Bytes of a splat on a device.
    static uint32_t splatSize(uint32_t degree, Storage storage);
    /// What the storage holds of splats that are valid: each value as the device decodes it. Quaternions become of
    /// length 1; StorageHalf rounds their components to the nearest multiple of 1/32767 before, and harmonics to the
    /// nearest float16, at most 65504.
    static Splats decoded(const Splats& splats, Storage storage);

private:
    Status build(const Device& device, const Splats& splats, Storage storage, Where where);

    Device device_;
    Error error_;
    Storage storage_ = StorageHalf;
    uint32_t degree_ = 0;
    uint32_t size_ = 0;
    BoundBox bounds_;
    std::vector<Chunk> chunks_;
};

}  // namespace glint
