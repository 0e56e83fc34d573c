#pragma once

// For sources only: the text at the beginning of an .npy file.

#include <glint/format/npy.h>

namespace glint::npy {

/// Magic, version and the longer of both forms of the header's length.
constexpr size_t prefix_size = 12;
constexpr uint64_t max_header = 1u << 20;

/// Where the header's text begins and ends. Needs the first prefix_size bytes, or all of a shorter file.
struct Extent {
    size_t begin = 0;
    size_t end = 0;
};
Expected<Extent> findHeader(std::span<const std::byte> bytes);

struct Parsed {
    NpyHeader header;
    std::vector<bool> swapped;  ///< fields in the other byte order than this machine's
};
/// `offset` is that of the text in the file, for messages.
Expected<Parsed> parseHeader(std::string_view text, size_t offset);

/// All bytes before the elements. Errors: "npy.type", "npy.shape".
Expected<std::vector<std::byte>> makeHeader(const NpyHeader& header);

/// Brings the fields so marked to this machine's byte order.
void swapFields(const NpyHeader& header, const std::vector<bool>& swapped, std::span<std::byte> elements);

}  // namespace glint::npy
