#pragma once

// Where the hierarchies of Glint's own tracing engine lie on the device: one buffer of 16-byte texels, which grows. A
// shader that was rewritten for the engine sees all of it, so that structures refer to one another by texel.

#include <glint/device/detail/object.h>
#include <glint/shader/shader_compiler.h>
#include <glint/tracing/detail/device_build.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <source_location>

namespace glint::detail {

/// How shaders read the heap: see shaders/tracing/memory.h.
enum class HeapForm : uint8_t { Texels, Storage, Address };
const char* toString(HeapForm form);

/// Bytes of each storage buffer that the heap is split into.
constexpr uint64_t heap_buffer_size = 128ull << 20;

class TracingHeap : public std::enable_shared_from_this<TracingHeap> {
public:
    using Where = std::source_location;

    /// A range of the heap, free again when it goes.
    class Range {
    public:
        Range() = default;
        Range(Range&& other) noexcept { *this = std::move(other); }
        Range& operator=(Range&& other) noexcept;
        ~Range() { release(); }
        void release();

        uint32_t first = 0;   ///< texel, a multiple of `alignment`
        uint64_t texels = 0;  ///< 0: none

    private:
        friend class TracingHeap;
        std::shared_ptr<TracingHeap> heap_;
    };
    /// Texels: 256 bytes, so that a range can be bound as any kind of buffer.
    static constexpr uint64_t alignment = 16;

    /// Form and nodes as $GLINT_TRACING_MEMORY ("texels", "storage", "address") and $GLINT_TRACING_NODES ("packed",
    /// "full") say, else the device's best.
    explicit TracingHeap(DeviceObject& device);

    /// May submit and wait, so not under a lock of the device. From any thread. Errors: "tracing.heap",
    /// "device.out_of_memory".
    Expected<Range> allocate(uint64_t texels, Where where);

    /// Writes to a range that no submitted work uses, if the host sees the device's memory.
    bool writeDirectly(const Range& range, const void* texels, uint64_t size);

    HeapForm form() const { return form_; }
    NodeForm nodes() const { return nodes_; }
    /// A kernel of the builder on the device, made when first asked for. From any thread. Errors: as of Kernel::create.
    Expected<KernelObject*> kernel(BuildKernel which);
    /// How shaders with ray queries are to be compiled.
    const TracingRewrite& rewrite() const { return rewrite_; }
    /// The texels; its native buffer is another one after growth. Who reads or writes a structure reads or writes it.
    BufferObject& texels() const { return *texels_; }
    /// What the library's uniform block holds: the heap's address.
    uint64_t address() const { return texels_->nativeBuffer()->address; }
    /// Elements of the library's array of storage buffers.
    uint32_t buffers() const { return buffers_; }

private:
    bool take(uint64_t texels, Range& range);
    void giveBack(uint32_t first, uint64_t texels);
    Status grow(uint64_t texels, Where where);

    DeviceObject& device_;
    HeapForm form_ = HeapForm::Texels;
    NodeForm nodes_ = NodeForm::Packed;
    TracingRewrite rewrite_;
    uint32_t buffers_ = 1;
    uint64_t limit_ = 0;  ///< texels
    Ref<BufferObject> texels_;
    std::mutex kernel_mutex_;
    std::array<Ref<KernelObject>, build_kernels> kernels_;
    std::mutex growth_;  // taken before mutex_
    std::mutex mutex_;   // of what follows
    uint64_t capacity_ = 0;
    std::map<uint64_t, uint64_t> free_;  ///< first texel to texels
};

}  // namespace glint::detail
