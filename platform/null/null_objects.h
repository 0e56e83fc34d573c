#pragma once

// The native objects of a null device.

#include <platform/null/null_control.h>

#include <glint/device/detail/backend.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::null {

/// Counts an object while it lives, and complains if it is deleted too early or too late.
class Life {
public:
    Life(std::shared_ptr<NullControl> control, uint64_t bytes, std::string name)
        : control_(std::move(control)), id_(control_->nextId()), bytes_(bytes), name_(std::move(name)) {}
    ~Life() { control_->destroy(id_, bytes_, name_, last_use); }
    Life(const Life&) = delete;
    Life& operator=(const Life&) = delete;

    uint64_t id() const { return id_; }

    /// Time-line values of the last submissions that use it. Guarded by the device's submit lock.
    std::array<uint64_t, detail::queue_count> last_use = {};

private:
    const std::shared_ptr<NullControl> control_;
    const uint64_t id_;
    const uint64_t bytes_;
    const std::string name_;
};

/// What every native object here is besides what the interface says.
struct NullObject {
    NullObject(std::shared_ptr<NullControl> control, uint64_t bytes, std::string name)
        : life(std::move(control), bytes, std::move(name)) {}
    virtual ~NullObject() = default;
    Life life;
};

/// An object whose accesses are judged.
struct NullMemory : NullObject {
    using NullObject::NullObject;
    uint32_t mips = 0;  ///< 0 for what is no texture
    uint32_t layers = 0;
};

/// Zeroed bytes, aligned as mapped device memory is. Pages that nobody touches cost nothing.
class HostMemory {
public:
    static constexpr size_t alignment = 64;
    explicit HostMemory(uint64_t size);
    bool isAllocated() const { return block_ != nullptr; }
    std::byte* data() const { return data_; }

private:
    struct Free {
        void operator()(void* block) const { std::free(block); }
    };
    std::unique_ptr<void, Free> block_;
    std::byte* data_ = nullptr;
};

struct NullBuffer final : detail::NativeBuffer, NullMemory {
    NullBuffer(std::shared_ptr<NullControl> control, const detail::NativeBufferDesc& desc)
        : NullMemory(std::move(control), desc.size, desc.name), size(desc.size), bytes(desc.size) {
        memory = desc.size;
    }
    const uint64_t size;
    const HostMemory bytes;
};

struct NullTexture final : detail::NativeTexture, NullMemory {
    NullTexture(std::shared_ptr<NullControl> control, const detail::NativeTextureDesc& desc);

    /// Bytes of all layers, mip levels and samples.
    static uint64_t size(const detail::NativeTextureDesc& desc);
    /// First texel of a layer of a mip level, sample by sample.
    std::byte* texels(uint32_t mip, uint32_t layer) const {
        return bytes.data() + layer * layer_size + mip_offsets[mip];
    }

    const TextureDesc desc;
    const uint32_t samples;
    uint64_t layer_size = 0;
    std::vector<uint64_t> mip_offsets;
    const HostMemory bytes;
};

struct NullSampler final : detail::NativeSampler, NullObject {
    using NullObject::NullObject;
};

struct NullTable final : detail::NativeTable, NullObject {
    using NullObject::NullObject;
};

struct NullKernel final : detail::NativeKernel, NullObject {
    using NullObject::NullObject;
    BindingLayout layout;
};

struct NullPipeline final : detail::NativePipeline, NullObject {
    using NullObject::NullObject;
    BindingLayout layout;
};

struct NullTraversal final : detail::NativeTraversal, NullObject {
    using NullObject::NullObject;
    BindingLayout layout;
};

struct NullTracing final : detail::NativeTracing, NullMemory {
    NullTracing(std::shared_ptr<NullControl> control, const detail::NativeTracingDesc& desc);

    /// Bytes of the structure.
    static uint64_t size(const detail::NativeTracingDesc& desc);

    Tracing::Type type = Tracing::TypeTriangle;
    bool is_compacted = false;
    std::vector<const detail::Object*> inputs;  ///< buffers of its geometries
    std::vector<uint64_t> references;           ///< addresses in the instances it was built from, each once
    uint64_t compacted_size = 0;
    uint64_t written_size = 0;  ///< by the last WriteTracingSize
};

struct NullQuery final : detail::NativeQuery, NullObject {
    using NullObject::NullObject;
    Query::Type type = Query::TypeTime;
    std::array<uint64_t, 7> begin = {};
    std::array<uint64_t, 7> result = {};
    bool ended = false;
};

/// An instance as a build reads it.
struct InstanceRecord {
    float transform[12];
    uint32_t data_and_mask;
    uint32_t offset_and_flags;
    uint64_t address;  ///< of the structure, 0 for none
};
static_assert(sizeof(InstanceRecord) == 64);

/// The structures that records refer to, each once.
std::vector<uint64_t> referencesOf(std::span<const std::byte> records);

/// The control of a new device.
std::shared_ptr<NullControl> makeControl();
NullSettings currentSettings();

}  // namespace glint::null
