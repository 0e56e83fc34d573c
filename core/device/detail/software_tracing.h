#pragma once

// The native side of a Tracing in the software engine: a range of the heap.

#include <glint/device/detail/backend.h>
#include <glint/device/detail/tracing_heap.h>
#include <glint/math/bounds.h>
#include <glint/tracing/detail/device_build.h>

#include <optional>
#include <string>

namespace glint::detail {

struct SoftwareTracing final : NativeTracing {
    TracingHeap::Range range;
    /// Of all primitives; unknown once the device has built or refitted it.
    std::optional<BoundBox> bounds = BoundBox();
    uint32_t nodes = 0;  ///< at most
    // What a build on the device takes.
    uint64_t device_texels = 0;
    uint32_t device_nodes = 0;
};

/// The native object if the software engine made it.
inline SoftwareTracing& softwareOf(const TracingObject& tracing) {
    return static_cast<SoftwareTracing&>(*tracing.native);
}

/// An unbuilt structure, with room for what the device or the host builds in place: any top level.
Expected<std::unique_ptr<NativeTracing>> createSoftwareTracing(DeviceObject& device, const TracingObject& tracing,
                                                               std::source_location where);

/// The structure as the device builds it.
DeviceInput deviceInput(const TracingObject& tracing);

/// For a kernel that traces a structure without a query, as shaders/tracing/batch.h does.
struct TexelHierarchy {
    Buffer texels;
    uint32_t first = 0;  ///< texel of the structure, until it is built anew
    std::string macros;  ///< of the form of its nodes
};
/// Nothing if the driver has it, or if shaders read the heap as something else than texels.
std::optional<TexelHierarchy> texelHierarchy(const Tracing& tracing);

/// How a structure's flags have it built on the host.
BuildMode buildMode(Tracing::Flags flags);

/// A top level from the instances that were set last. Those whose structure is not bounded make it fail: see
/// SoftwareTracing::bounds. The instances' texels are those of now.
Expected<Hierarchy> buildInstances(const TracingObject& tracing);

}  // namespace glint::detail
