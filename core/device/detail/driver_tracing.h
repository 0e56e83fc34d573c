#pragma once

// Structures as the driver builds them. With the driver's engine they are the Tracing's own; with the software engine
// they stand beside it on devices with a Traversal, each as a TracingObject of its own that no handle refers to.

#include <glint/device/detail/object.h>

#include <algorithm>
#include <source_location>
#include <span>
#include <vector>

namespace glint::detail {

/// Gives a configured structure the driver's native object and, if it is a top level, room for its instances.
/// Errors: "device.out_of_memory", "vulkan.result".
Error createDriverNative(TracingObject& tracing, std::source_location where);

/// Software engine: the structure's counterpart, which is made when first asked for. Errors: as above.
Expected<TracingObject*> driverTracing(TracingObject& tracing, std::source_location where);

/// Software engine: the structure that keeps a Traversal from seeing this one, as the driver has not built it; nullptr
/// if nothing does.
const TracingObject* notBuiltByDriver(const TracingObject& tracing);

/// Scratch memory for builds to run side by side, within reason.
inline uint64_t reasonableScratch(uint64_t largest, uint64_t total) {
    constexpr uint64_t reasonable = 32ull << 20;
    return std::max(largest, std::min(total, reasonable));
}

/// Calls build(tracings, offsets) for as many builds, or updates, at a time as find room in `size` bytes of scratch
/// memory, which are enough for each of them.
template <class Build>
void forEachBatch(std::span<TracingObject* const> tracings, bool update, uint64_t size, uint64_t alignment,
                  Build&& build) {
    std::vector<uint64_t> offsets;
    uint64_t offset = 0;
    size_t first = 0;
    for (size_t i = 0; i < tracings.size(); i++) {
        const NativeTracing& native = *tracings[i]->nativeTracing();
        const uint64_t needed = update ? native.update_size : native.build_size;
        if (offset + needed > size) {
            if (i > first) build(tracings.subspan(first, i - first), std::span<const uint64_t>(offsets));
            offsets.clear();
            offset = 0;
            first = i;
        }
        offsets.push_back(offset);
        offset += (needed + alignment - 1) / alignment * alignment;
    }
    if (first < tracings.size()) build(tracings.subspan(first), std::span<const uint64_t>(offsets));
}

}  // namespace glint::detail
