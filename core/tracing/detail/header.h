#pragma once

// The first four texels of a hierarchy.

#include <glint/tracing/detail/node.h>

#include <bit>
#include <cstring>

namespace glint::detail {

struct Header {
    float minimum[3];  ///< of the grid
    float step;
    uint32_t scale_bits;  ///< a plane's scale has the bits  scale_bits + (exponent << 23)
    uint32_t nodes;
    uint32_t first_record;  ///< texel
    uint32_t records;
    float lo[3];  ///< box of all primitives; lo > hi if there are none
    uint32_t kind;
    float hi[3];
    uint32_t first_instance;  ///< texel
};
static_assert(sizeof(Header) == 4 * sizeof(Texel));

void writeHeader(Hierarchy& hierarchy, const Grid& grid, const Box4& bounds);

inline Header readHeader(const Hierarchy& hierarchy) {
    Header header;
    std::memcpy(&header, hierarchy.texels.data(), sizeof(header));
    return header;
}

}  // namespace glint::detail
