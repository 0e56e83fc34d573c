#pragma once

// Mip levels by compute. Each level is the mean of what its texels cover of the level below, in float32 and in linear
// values; where the scratch memory has room, the level below is the one that the pass before has kept in float32, so
// that only what is stored is rounded. Formats need no support but sampling and copies: a pass writes a level's bytes
// to scratch memory, from where they are copied.

#include <glint/device/detail/object.h>
#include <glint/device/texture.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <source_location>
#include <vector>

namespace glint::detail {

/// A dispatch: a box of a level, whole rows of some slices (layers, or z of a volume).
struct MipmapPass {
    uint32_t level = 1;
    uint32_t first_slice = 0;
    uint32_t slices = 1;
    uint32_t first_row = 0;
    uint32_t rows = 1;
    bool from_kept = false;  ///< reads the level below as the pass before has kept it, else as it is stored
    bool keeps = false;      ///< keeps the level in float32
    uint64_t kept = 0;       ///< bytes into the scratch memory: the level in float32
    uint64_t stored = 0;     ///< the same: the level's bytes
};

struct MipmapPlan {
    std::vector<MipmapPass> passes;
    uint64_t scratch = 0;  ///< bytes
};

/// Bytes of a texel in float32.
uint32_t keptSize(Format format);
/// Bytes that a pass leaves in scratch memory, at `stored`: whole words.
uint64_t storedSize(const TextureDesc& desc, const MipmapPass& pass);

/// The passes of all levels above 0, those that read what another one keeps after it. Places in scratch memory are
/// multiples of `alignment`, a power of two. Levels that do not fit into `budget` bytes together with those above them
/// are made from what is stored, layer by layer and in bands of rows: no row exceeds the budget.
MipmapPlan planMipmaps(const TextureDesc& desc, uint64_t alignment, uint64_t budget);

/// The push constants of shaders/textures/mipmap.h.
struct MipmapConstants {
    uint32_t below[3];
    uint32_t first_row;
    uint32_t size[3];
    uint32_t first_slice;
    uint32_t rows;
    uint32_t slices;
    uint32_t keep;
};
MipmapConstants mipmapConstants(const TextureDesc& desc, const MipmapPass& pass);

/// The kernels of a device, each made when first asked for.
class MipmapKernels {
public:
    explicit MipmapKernels(DeviceObject& device) : device_(device) {}

    /// False for formats that have no mean: whole numbers, depth, compressed ones.
    static bool canFilter(Format format);
    /// From any thread. Errors: as of Kernel::create.
    Expected<KernelObject*> kernel(const TextureDesc& desc, const MipmapPass& pass, std::source_location where);
    /// Groups of a dispatch that makes the pass.
    static void countGroups(const TextureDesc& desc, const MipmapPass& pass, uint32_t (&groups)[3]);
    /// Gives them up, before the device goes.
    void clear() { kernels_.clear(); }

private:
    DeviceObject& device_;
    std::mutex mutex_;
    std::map<uint32_t, Ref<KernelObject>> kernels_;  ///< by format and form
};

}  // namespace glint::detail
