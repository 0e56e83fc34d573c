#include <platform/null/hazard_range.h>

#include <algorithm>
#include <span>

namespace glint::null {

using namespace detail;

namespace {

template <class T>
const T* as(const CommandHeader& header) {
    return header.size >= sizeof(T) ? reinterpret_cast<const T*>(&header) : nullptr;
}

ByteRange join(const ByteRange& a, const ByteRange& b) { return {std::min(a.begin, b.begin), std::max(a.end, b.end)}; }

/// Storage blocks and texel buffers. What else reaches the buffer (by address, or as uniform block, whose offset is
/// kept elsewhere) makes the range unknown.
ByteRange boundRange(const CommandList& list, const CommandHeader& header, const Bindings& bindings,
                     uint32_t resource) {
    if (bindings.bound == none) return {};
    ByteRange range{UINT64_MAX, 0};
    uint32_t bound = 0, accesses = 0;
    for (const BoundResource& one : std::span(list.at<BoundResource>(bindings.bound), bindings.bound_count)) {
        if (one.resource != resource) continue;
        range = join(range, {one.offset, one.offset + one.size});
        bound++;
    }
    bool is_read_only = false;
    const auto look = [&](uint32_t first, uint32_t count) {
        for (const Access& access : std::span(list.accesses).subspan(first, count)) {
            if (access.resource != resource) continue;
            accesses++;
            is_read_only |= !(access.flags & AccessWrite);
        }
    };
    look(header.first_access, header.access_count);
    look(header.first_shared, header.shared_count);
    const bool is_known = bound == accesses && !(is_read_only && bindings.uniform_count);
    return is_known ? range : ByteRange{};
}

}  // namespace

ByteRange touchedRange(const CommandList& list, const CommandHeader& header, uint32_t resource) {
    switch (header.type) {
        case CommandType::Dispatch:
            if (const auto* command = as<DispatchCommand>(header))
                return boundRange(list, header, command->bindings, resource);
            break;
        case CommandType::TraceRays:
            if (const auto* command = as<TraceRaysCommand>(header))
                return boundRange(list, header, command->bindings, resource);
            break;
        case CommandType::CopyInline:
            if (const auto* command = as<CopyInlineCommand>(header))
                return {command->offset, command->offset + command->size};
            break;
        case CommandType::FillBuffer:
            if (const auto* command = as<FillBufferCommand>(header))
                return {command->offset, command->offset + command->size};
            break;
        case CommandType::CopyBuffer:
            if (const auto* command = as<CopyBufferCommand>(header)) {
                const ByteRange source{command->source_offset, command->source_offset + command->size};
                const ByteRange destination{command->destination_offset, command->destination_offset + command->size};
                if (command->source == command->destination) return join(source, destination);
                return resource == command->source ? source : destination;
            }
            break;
        default: break;
    }
    return {};
}

ByteRange touchedRange(const CommandList& list, const SideDispatch& dispatch, uint32_t resource) {
    ByteRange range{UINT64_MAX, 0};
    const Bindings& bindings = dispatch.bindings;
    for (const BoundResource& one : std::span(list.at<BoundResource>(bindings.bound), bindings.bound_count))
        if (one.resource == resource) range = join(range, {one.offset, one.offset + one.size});
    return range.begin < range.end ? range : ByteRange{};
}

}  // namespace glint::null
