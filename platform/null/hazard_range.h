#pragma once

#include <glint/device/detail/command_list.h>

#include <cstdint>

namespace glint::null {

struct ByteRange {
    uint64_t begin = 0;
    uint64_t end = UINT64_MAX;  ///< of a buffer whose touched part is not known

    bool covers(const ByteRange& other) const { return begin <= other.begin && end >= other.end; }
    bool meets(const ByteRange& other) const { return begin < other.end && other.begin < end; }
};

/// The part of a buffer that a command touches, as far as its own words say. Accesses themselves name whole buffers,
/// which is what Glint orders by; who looks after hazards himself may let commands share a buffer.
ByteRange touchedRange(const detail::CommandList& list, const detail::CommandHeader& header, uint32_t resource);

/// The same of one dispatch of several.
ByteRange touchedRange(const detail::CommandList& list, const detail::SideDispatch& dispatch, uint32_t resource);

}  // namespace glint::null
