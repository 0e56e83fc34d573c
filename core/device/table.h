#pragma once

#include <glint/device/buffer.h>
#include <glint/device/handle.h>
#include <glint/device/texture.h>
#include <glint/device/types.h>

#include <cstdint>
#include <source_location>

namespace glint {

/// Textures that a shader indexes as it likes: `uniform texture2D textures[]`, bound with setTextureTable. Created by
/// Device::createTextureTable, with nothing in it.
///
/// A list sees a table as it was when setTextureTable was called: what is set afterwards is for later calls, so that a
/// table may be changed at any time. The table keeps what is in it. An entry with nothing reads as 0 in all channels;
/// an index beyond the table's count is undefined, as Vulkan has it. What the table holds is tracked like anything that
/// is bound.
///
/// Setting an entry costs a copy of the table's list the first time after a list has seen it, and new descriptors for
/// the next list. Any thread may set entries. A wrong one fails the table, as with any other handle.
class TextureTable : public Handle {
public:
    using Where = std::source_location;

    TextureTable() = default;
    explicit TextureTable(detail::Object* object) : Handle(object) {}

    /// Entries; 0 unless ready.
    uint32_t getCount() const;
    /// A null texture leaves nothing there. The texture, and its layers, have to suit what shaders declare, which is
    /// checked when one uses the table ("bind.texture_type"). Errors: "table.index", "table.entry", "texture.slice".
    void set(uint32_t index, const Texture& texture, const Slice& slice = {}, Where where = Where::current());
};

/// Buffers that a shader indexes as it likes: `buffer Block { ... } blocks[]`, bound with setBufferTable. Created by
/// Device::createBufferTable. Everything said of TextureTable holds; an entry with nothing reads as 0, and what is
/// written to it is lost.
class BufferTable : public Handle {
public:
    using Where = std::source_location;

    BufferTable() = default;
    explicit BufferTable(detail::Object* object) : Handle(object) {}

    /// Entries; 0 unless ready.
    uint32_t getCount() const;
    /// A part of a buffer made with FlagStorage, `size` 0: all from `offset`, which is a multiple of
    /// Features::storageAlignment. A null buffer leaves nothing there. Errors: "table.index", "table.entry",
    /// "buffer.flag", "bind.alignment", "bind.range", "bind.too_large".
    void set(uint32_t index, const Buffer& buffer, uint64_t offset = 0, uint64_t size = 0,
             Where where = Where::current());
};

}  // namespace glint
