#pragma once

// How the readers of splats make them: in blocks, on several threads, every splat judged by the same rule.

#include <glint/base/file.h>
#include <glint/format/splats.h>

#include <functional>
#include <string>

namespace glint::detail {

/// A splat as a file has it, but for its harmonics.
struct FileSplat {
    Vector3f position;
    Vector3f scale;       ///< or its logarithms
    Vector4f quaternion;  ///< (x, y, z, w), of any length
    float opacity;        ///< or its logit
};

/// Some splats of a file.
struct SplatBlock {
    static constexpr uint32_t capacity = 2048;

    std::vector<std::byte> bytes;     ///< for the reader's own use
    std::vector<FileSplat> splats;    ///< `capacity`
    std::vector<Vector3f> harmonics;  ///< those of `capacity` splats, one splat after the other
};

/// What a file has, and how to get it.
struct SplatSource {
    std::string name;  ///< of the file, for errors
    uint64_t count = 0;
    uint32_t degree = 0;
    bool is_logarithmic = false;  ///< scales are logarithms, opacities logits

    /// Reads splats `first` to `first + count`, at most SplatBlock::capacity, into a block's arrays. Called from
    /// several threads where there are many.
    std::function<Status(uint64_t first, uint32_t count, SplatBlock& block)> read;
};

/// Makes splats of a file; docs/splatting.md, "Files", has the rule for bad values. Errors: those of the source,
/// "splats.too_large" (they would take more than `limit` bytes).
Expected<Splats> readSplats(const SplatSource& source, uint64_t limit, SplatReport* report);

/// "splats.too_large" if the source's splats take more than `limit` bytes.
Status checkSplatBytes(const SplatSource& source, uint64_t limit);

// What parsePlySplats and parseDotSplat do, with only a part of the file in memory at a time. Errors: those and those
// of readFile.
Expected<Splats> loadPlySplats(const std::filesystem::path& path, uint64_t limit, SplatReport* report);
Expected<Splats> loadDotSplat(const std::filesystem::path& path, uint64_t limit, SplatReport* report);

}  // namespace glint::detail
