#include <glint/device/table.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/table_object.h>
#include <glint/device/detail/texture_layout.h>

namespace glint {

namespace detail {

Expected<Ref<TableContents>> TableObject::makeContents(DeviceObject& device, SlotKind element, size_t count,
                                                       const std::string& name) {
    Expected<std::unique_ptr<NativeTable>> made = device.backend->createTable(name);
    if (!made) return unexpected(made.error());
    auto contents = Ref<TableContents>::adopt(new TableContents(&device, element));
    contents->entries.resize(count);
    contents->native = std::move(*made);
    contents->setName(name);
    contents->setReady();
    return contents;
}

Ref<TableContents> TableObject::see() {
    std::lock_guard lock(mutex_);
    seen = true;
    return contents;
}

uint32_t TableObject::count() const {
    std::lock_guard lock(mutex_);
    return static_cast<uint32_t>(contents->entries.size());
}

Error TableObject::set(uint32_t index, TableContents::Entry entry) {
    Ref<TableContents> old;  // goes without the lock
    std::lock_guard lock(mutex_);
    if (seen) {
        Expected<Ref<TableContents>> copy =
            makeContents(*device(), contents->element, contents->entries.size(), name());
        if (!copy) return copy.error();
        (*copy)->entries = contents->entries;
        old = std::exchange(contents, std::move(*copy));
        seen = false;
    }
    std::swap(contents->entries[index], entry);
    return {};
}

}  // namespace detail

namespace {

using detail::TableContents;
using detail::TableObject;
using Where = std::source_location;

/// The table, if `entry` can be put at `index` of it as far as every kind of entry goes.
TableObject* settable(const Handle& handle, uint32_t index, const Handle& entry, Where where) {
    if (!handle) return nullptr;
    auto* table = static_cast<TableObject*>(handle.object());
    if (index >= table->count()) {
        table->fail(makeError(where, ErrorCode::OutOfRange, "table.index", "{}: entry {} of {}", table->label(), index,
                              table->count()));
        return nullptr;
    }
    if (entry.state() == ObjectState::Null || entry) {
        if (!entry || entry.object()->device() == table->device()) return table;
        table->fail(makeError(where, ErrorCode::InvalidArgument, "handle.device", "{}: {} belongs to another device",
                              table->label(), entry.object()->label()));
        return nullptr;
    }
    table->fail(makeError(where, ErrorCode::InvalidArgument, "table.entry", "{}: entry {}, {}, is not usable: {}",
                          table->label(), index, entry.object()->label(), entry.error().message()));
    return nullptr;
}

void put(TableObject& table, uint32_t index, TableContents::Entry entry, Where where) {
    if (Error error = table.set(index, std::move(entry))) table.fail(error.at(where));
}

uint32_t countOf(const Handle& table) { return table ? static_cast<TableObject*>(table.object())->count() : 0; }

}  // namespace

uint32_t TextureTable::getCount() const { return countOf(*this); }
uint32_t BufferTable::getCount() const { return countOf(*this); }

void TextureTable::set(uint32_t index, const Texture& texture, const Slice& slice, Where where) {
    TableObject* const table = settable(*this, index, texture, where);
    if (!table) return;
    TableContents::Entry entry;
    if (texture) {
        auto* object = static_cast<detail::TextureObject*>(texture.object());
        entry.object = detail::Ref<detail::Object>(object);
        entry.slice = slice;
        if (!detail::resolveSlice(object->desc, entry.slice)) {
            table->fail(
                makeError(where, ErrorCode::OutOfRange, "texture.slice",
                          "{}: {} mip levels from {}, {} layers from {} exceed {} with {} mip levels and {} layers",
                          table->label(), slice.mips, slice.mip, slice.layers, slice.layer, object->label(),
                          object->desc.mipmaps, object->desc.layers));
            return;
        }
    }
    put(*table, index, std::move(entry), where);
}

void BufferTable::set(uint32_t index, const Buffer& buffer, uint64_t offset, uint64_t size, Where where) {
    TableObject* const table = settable(*this, index, buffer, where);
    if (!table) return;
    TableContents::Entry entry;
    if (buffer) {
        auto* object = static_cast<detail::BufferObject*>(buffer.object());
        const Features& features = table->device()->features();
        const auto refuse = [&](ErrorCode code, const char* id, std::string_view message) {
            table->fail(
                makeError(where, code, id, "{}: entry {}, {}: {}", table->label(), index, object->label(), message));
        };
        if (!(object->flags & Buffer::FlagStorage))
            return refuse(ErrorCode::InvalidArgument, "buffer.flag", "it was made without Buffer::FlagStorage");
        if (offset % features.storageAlignment)
            return refuse(ErrorCode::InvalidArgument, "bind.alignment",
                          fmt::format("offset {} is no multiple of {}", offset, features.storageAlignment));
        if (offset >= object->size || size > object->size - offset)
            return refuse(ErrorCode::OutOfRange, "bind.range",
                          fmt::format("{} bytes from offset {} exceed its {} bytes", size, offset, object->size));
        if (size == 0) size = object->size - offset;
        if (size > features.maxStorageSize)
            return refuse(ErrorCode::OutOfRange, "bind.too_large",
                          fmt::format("{} bytes exceed the limit of {}", size, features.maxStorageSize));
        entry = {detail::Ref<detail::Object>(object), {}, offset, size};
    }
    put(*table, index, std::move(entry), where);
}

}  // namespace glint
