#pragma once

#include <glint/device/detail/object.h>

#include <mutex>
#include <vector>

namespace glint::detail {

/// What a table held at some time. Constant once a list has seen it; its native object is what the back end makes of
/// it, once for each layout that it is bound with.
class TableContents final : public Object {
public:
    struct Entry {
        Ref<Object> object;  ///< nothing, a TextureObject or a BufferObject
        Slice slice;         ///< of a texture, resolved
        uint64_t offset = 0;
        uint64_t size = 0;  ///< of a buffer, resolved
    };

    TableContents(DeviceObject* device, SlotKind kind) : Object(ObjectType::Table, device), element(kind) {}

    const SlotKind element;  ///< Texture or Storage
    std::vector<Entry> entries;
};

class TableObject final : public Object {
public:
    TableObject(DeviceObject* device, SlotKind element)
        : Object(element == SlotKind::Texture ? ObjectType::TextureTable : ObjectType::BufferTable, device) {}

    /// The contents as they are now, which stay so.
    Ref<TableContents> see();
    /// Puts an entry into the contents, or into a copy if somebody has seen them.
    Error set(uint32_t index, TableContents::Entry entry);
    uint32_t count() const;

    /// Empty ones of `count` entries. Errors: those of the back end.
    static Expected<Ref<TableContents>> makeContents(DeviceObject& device, SlotKind element, size_t count,
                                                     const std::string& name);

    Ref<TableContents> contents;  ///< there is one as soon as the object is ready; guarded by `mutex`
    bool seen = false;            ///< likewise

private:
    mutable std::mutex mutex_;
};

}  // namespace glint::detail
