#pragma once

#include <glint/base/status.h>
#include <glint/device/buffer.h>
#include <glint/device/query.h>
#include <glint/device/sampler.h>
#include <glint/device/table.h>
#include <glint/device/texture.h>
#include <glint/device/tracing.h>

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <source_location>
#include <span>
#include <string_view>
#include <type_traits>

namespace glint {

namespace detail {
class RecorderCore;
struct RecorderDeleter {
    void operator()(RecorderCore* core) const;
};
using RecorderPtr = std::unique_ptr<RecorderCore, RecorderDeleter>;
}  // namespace detail

/// What may be copied byte by byte.
template <class T>
concept TriviallyCopyable = std::is_trivially_copyable_v<T>;

/// Names a resource of the current program: the i-th of its kind in (set, binding) order, or by the shader's own name,
/// or by set and binding. Remembers the line of the call for messages.
class Slot {
public:
    using Where = std::source_location;

    template <std::integral Integer>
    Slot(Integer index, Where where = Where::current()) : index_(static_cast<int64_t>(index)), where_(where) {}
    Slot(const char* name, Where where = Where::current()) : name_(name), where_(where) {}
    static Slot at(uint32_t set, uint32_t binding, Where where = Where::current()) {
        Slot slot(0, where);
        slot.set_ = set;
        slot.binding_ = binding;
        slot.by_binding_ = true;
        return slot;
    }

private:
    friend class detail::RecorderCore;
    int64_t index_ = 0;
    const char* name_ = nullptr;
    uint32_t set_ = 0;
    uint32_t binding_ = 0;
    bool by_binding_ = false;
    Where where_;
};

/// What Compute and Command have in common: bindings, constants, queries, regions. Move-only. A recorder writes a list
/// of commands that Device::submit plays; nothing reaches the GPU before. Recording calls return nothing: the first
/// error is kept, told to the device's message callback, and returned by end() and submit(). One thread may record
/// each; recorders of one device may be recorded at the same time.
///
/// Bindings stay until they are replaced, also over a change of kernel, pipeline or traversal.
class Recorder {
public:
    using Where = std::source_location;

    Recorder(Recorder&& other) noexcept;
    Recorder& operator=(Recorder&& other) noexcept;
    ~Recorder();

    /// True while no error has happened.
    explicit operator bool() const { return !error(); }
    Error error() const;
    /// Fails the list as a wrong call does, unless it has failed already: for what is written on top of recorders.
    void fail(const Error& error);
    /// Closes the list. Further recording fails with "recorder.ended".
    Status end();

    /// Uploads `data` inline as uniform block of the slot. Its size must be that of the block, rounded up to 16 bytes
    /// or not ("bind.uniform_size").
    template <TriviallyCopyable T>
    void setUniform(Slot slot, const T& data) {
        setUniformData(slot, &data, sizeof(T));
    }
    void setUniformData(Slot slot, const void* data, uint64_t size);
    /// `size` 0: all from `offset`, which is a multiple of Features::uniformAlignment.
    void setUniformBuffer(Slot slot, const Buffer& buffer, uint64_t offset = 0, uint64_t size = 0);
    void setStorageBuffer(Slot slot, const Buffer& buffer, uint64_t offset = 0, uint64_t size = 0);
    /// Consecutive slots, or the elements of one array slot.
    void setStorageBuffers(Slot slot, std::initializer_list<Buffer> buffers);
    void setTexture(Slot slot, const Texture& texture, const Slice& slice = {});
    void setTextures(Slot slot, std::initializer_list<Texture> textures);
    /// One mip level of a texture made with FlagSurface.
    void setSurfaceTexture(Slot slot, const Texture& texture, const Slice& slice = {});
    void setSurfaceTextures(Slot slot, std::initializer_list<Texture> textures);
    void setSampler(Slot slot, const Sampler& sampler);
    void setSamplers(Slot slot, std::initializer_list<Sampler> samplers);
    /// A structure and, for a top level, all that it refers to.
    void setTracing(Slot slot, const Tracing& tracing);
    /// A table as it is now. Slots of tables of textures and of buffers are counted together. Errors: "bind.table",
    /// "bind.texture_type", "bind.storage_size".
    void setTextureTable(Slot slot, const TextureTable& table);
    void setBufferTable(Slot slot, const BufferTable& table);
    void setTexelBuffer(Slot slot, const Buffer& buffer, Format format, uint64_t offset = 0, uint64_t size = 0);

    /// Push constants of the current program, from its first byte on ("bind.push_size").
    template <TriviallyCopyable T>
    void setPushConstants(const T& data, Where where = Where::current()) {
        setPushData(&data, sizeof(T), where);
    }
    void setPushData(const void* data, uint64_t size, Where where = Where::current());

    /// The commands from now on reach this buffer by its address: it is tracked as if they read, or read and wrote it.
    void useBuffer(const Buffer& buffer, bool write, Where where = Where::current());
    /// Ends what useBuffer began, for all buffers.
    void clearUses();

    /// With false the caller looks after hazards with barrier() from here on; layouts of textures are still taken care
    /// of.
    void setTracking(bool enabled);
    /// Orders everything before it before everything after it. With tracking on it is accepted and does nothing.
    void barrier(Where where = Where::current());
    void barrier(const Buffer& buffer, Where where = Where::current());
    void barrier(const Texture& texture, Where where = Where::current());
    void barrier(std::initializer_list<Buffer> buffers, Where where = Where::current());
    void barrier(std::initializer_list<Texture> textures, Where where = Where::current());

    void beginQuery(const Query& query, Where where = Where::current());
    void endQuery(const Query& query, Where where = Where::current());

    /// Names the work that follows, in debuggers and in messages. Regions nest and must be balanced
    /// ("recorder.region").
    void pushRegion(std::string_view name, Where where = Where::current());
    void popRegion(Where where = Where::current());

    detail::RecorderCore* core() const { return core_.get(); }

protected:
    explicit Recorder(detail::RecorderPtr core);

    detail::RecorderPtr core_;
};

}  // namespace glint
