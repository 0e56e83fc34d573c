#pragma once

// Plays plans of core/tracing/detail/device_build.h through the public object model.

#include <glint/device/device.h>
#include <glint/tracing/detail/device_build.h>

#include <optional>
#include <span>
#include <vector>

namespace glint::test {

/// A geometry's buffers, made with FlagStorage.
struct GeometryBuffers {
    Buffer data;
    Buffer indices;
};

/// The heap as shaders reach it: GLINT_TRACING_MEMORY.
enum class HeapForm : uint8_t { Texels, Storage, Address };

class DeviceBuilder {
public:
    explicit DeviceBuilder(const Device& device, HeapForm heap = HeapForm::Texels,
                           detail::NodeForm nodes = detail::NodeForm::Packed)
        : device_(device), heap_(heap), nodes_(nodes) {}

    /// A buffer for `texels` of the heap.
    Buffer createHeap(uint64_t texels);
    /// Storage for bytes, filled up to a multiple of 4.
    Buffer createStorage(std::span<const std::byte> bytes);

    /// Plays and submits a plan for this form of nodes. Throws std::runtime_error with what went wrong.
    void play(const detail::BuildPlan& plan, const Buffer& heap, std::span<const GeometryBuffers> geometries);
    /// Records into a list; `scratch` has the plan's bytes.
    void record(Compute& compute, const detail::BuildPlan& plan, const Buffer& heap, const Buffer& scratch,
                std::span<const GeometryBuffers> geometries);

    /// The hierarchy that begins at a texel of the heap; its depth is 0.
    detail::Hierarchy read(const Buffer& heap, uint32_t texel);

private:
    const Kernel& kernel(detail::BuildKernel kernel);

    Device device_;
    HeapForm heap_;
    detail::NodeForm nodes_;
    Kernel kernels_[detail::build_kernels];
};

}  // namespace glint::test
