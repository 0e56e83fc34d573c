#include <glint/device/detail/recorder_core.h>

#include <glint/device/detail/texture_layout.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace glint::detail {

void RecorderDeleter::operator()(RecorderCore* core) const {
    // Kept by a local, because recycling may drop the device's last other reference.
    const Ref<DeviceObject> device = core->keep;
    device->recycleRecorder(core);
}

void RecorderCore::begin(Queue queue, std::string_view name) {
    // Work for a queue that the adapter lacks goes to the main one, and may be no other work for that.
    asked_ = queue;
    queue_ = device_->backend->hasQueue(queue) ? queue : Queue::Main;
    list_.label = name;
    list_.error = {};
    submitted = false;
    ended_ = false;
    tracking_ = true;
    graphics_ = false;
    generation_++;
    program_ = nullptr;
    traversal_ = nullptr;
    bindings_ = {};
    bindings_dirty_ = uniforms_dirty_ = push_dirty_ = vertices_dirty_ = dynamic_dirty_ = true;
    first_shared_ = shared_count_ = 0;
    push_size_ = 0;
    region_depth_ = 0;
    vertices_ = {};
    indices_ = {};
    dynamic_ = {};
}

void RecorderCore::clear() {
    for (TracingObject* tracing : first_builds_) tracing->built = false;
    first_builds_.clear();
    for (Object* object : list_.resources) object->unhold();
    list_.resources.clear();
    list_.pictures.clear();
    list_.bytes.clear();
    list_.commands.clear();
    list_.accesses.clear();
    list_.inline_data.clear();
    list_.command_count = 0;
    list_.region_depth = 0;
    for (auto& slots : bound_)
        for (Bound& bound : slots) {
            bound.set = false;
            bound.elements.clear();
        }
    uses_.clear();
    placements_.clear();
    moves_.clear();
    pending_.clear();
    shared_scratch_ = 0;
    heap_block_ = none;
    open_queries_.clear();
    target_ = {};
}

void RecorderCore::fail(const Error& error) {
    if (list_.error) return;
    list_.error = error;
    device_->report(error);
}

void RecorderCore::keepError(const Error& error) {
    if (!list_.error) list_.error = error;
}

bool RecorderCore::recording(Where where) {
    if (list_.error) return false;
    if (ended_) {
        fail(where, ErrorCode::InvalidArgument, "recorder.ended", "the recorder '{}' has ended and records no more",
             list_.label);
        return false;
    }
    return true;
}

Status RecorderCore::end(Where where) {
    if (ended_ || list_.error) {
        ended_ = true;
        return list_.error;
    }
    if (region_depth_)
        fail(where, ErrorCode::InvalidArgument, "recorder.region", "{} regions were pushed and not popped",
             region_depth_);
    if (!open_queries_.empty())
        fail(where, ErrorCode::InvalidArgument, "query.open", "{} was begun and not ended",
             open_queries_.back().object()->label());
    if (!pending_.isEmpty()) playPending();
    if (graphics_ && !list_.error) {
        beginAccesses();
        push<EndTargetCommand>(CommandType::EndTarget);
    }
    ended_ = true;
    return list_.error;
}

bool RecorderCore::usable(const Handle& handle, const char* what, Where where) {
    if (handle.state() == ObjectState::Null) {
        fail(where, ErrorCode::InvalidArgument, "handle.null", "{}: the handle is null", what);
        return false;
    }
    if (handle.state() != ObjectState::Ready) {
        const Error error = handle.error();
        fail(where, ErrorCode::InvalidArgument, "handle.not_ready", "{}: {} {}{}", what, handle.object()->label(),
             error ? "failed: " : "has not been created", error.message());
        return false;
    }
    if (handle.object()->device() && handle.object()->device() != device_) {
        fail(where, ErrorCode::InvalidArgument, "handle.device", "{}: {} belongs to another device", what,
             handle.object()->label());
        return false;
    }
    return true;
}

bool RecorderCore::onQueue(Queue last, const char* what, Where where) {
    if (asked_ <= last) return true;
    fail(where, ErrorCode::InvalidArgument, "recorder.queue",
         "{}: the recorder '{}' is for Queue::{}, which cannot do it", what, list_.label,
         asked_ == Queue::Copy ? "Copy" : "Compute");
    return false;
}

BufferObject* RecorderCore::usableBuffer(const Buffer& buffer, Buffer::Flag flag, const char* what, Where where) {
    if (!usable(buffer, what, where)) return nullptr;
    auto* object = static_cast<BufferObject*>(buffer.object());
    if (flag && !(object->flags & flag)) {
        const char* names[] = {"FlagUniform", "FlagStorage", "FlagVertex",  "FlagIndex",   "FlagIndirect",
                               "FlagTexel",   "FlagAddress", "FlagTracing", "FlagScratch", "FlagMapped"};
        fail(where, ErrorCode::InvalidArgument, "buffer.flag", "{}: {} was made without Buffer::{}", what,
             object->label(), names[std::countr_zero(static_cast<uint32_t>(flag))]);
        return nullptr;
    }
    return object;
}

bool RecorderCore::inRange(const BufferObject& buffer, uint64_t offset, uint64_t size, const char* what, Where where) {
    if (offset <= buffer.size && size <= buffer.size - offset) return true;
    fail(where, ErrorCode::OutOfRange, "copy.range", "{}: {} bytes from offset {} exceed {} of {} bytes", what, size,
         offset, buffer.label(), buffer.size);
    return false;
}

bool RecorderCore::resolve(const TextureObject& texture, Slice& slice, const char* what, Where where) {
    const Slice asked = slice;
    if (resolveSlice(texture.desc, slice)) return true;
    fail(where, ErrorCode::OutOfRange, "texture.slice",
         "{}: {} mip levels from {}, {} layers from {} exceed {} with {} mip levels and {} layers", what, asked.mips,
         asked.mip, asked.layers, asked.layer, texture.label(), texture.desc.mipmaps, texture.desc.layers);
    return false;
}

uint32_t RecorderCore::use(Object& object) {
    // At most half full, so that probes are short.
    if (table_.size() < (list_.resources.size() + 1) * 2) {
        table_.assign(std::max<size_t>(64, std::bit_ceil((list_.resources.size() + 1) * 4)), {});
        for (uint32_t i = 0; i < list_.resources.size(); i++) {
            size_t place = (reinterpret_cast<uintptr_t>(list_.resources[i]) >> 4) * 0x9e3779b97f4a7c15ull >> 20;
            while (table_[place & (table_.size() - 1)].object) place++;
            table_[place & (table_.size() - 1)] = {list_.resources[i], i, generation_};
        }
    }
    size_t place = (reinterpret_cast<uintptr_t>(&object) >> 4) * 0x9e3779b97f4a7c15ull >> 20;
    for (;; place++) {
        TableEntry& entry = table_[place & (table_.size() - 1)];
        if (!entry.object || entry.generation != generation_) {
            entry = {&object, static_cast<uint32_t>(list_.resources.size()), generation_};
            object.hold();
            list_.resources.push_back(&object);
            if (object.type() == ObjectType::Texture && static_cast<TextureObject&>(object).is_picture)
                list_.pictures.push_back(entry.index);
            return entry.index;
        }
        if (entry.object == &object) return entry.index;
    }
}

uint32_t RecorderCore::room(size_t size, size_t alignment) {
    if (size == 0) return none;
    const size_t offset = (list_.bytes.size() + alignment - 1) / alignment * alignment;
    list_.bytes.resize(offset + size);
    return static_cast<uint32_t>(offset);
}

uint32_t RecorderCore::append(const void* data, size_t size, size_t alignment) {
    const size_t offset = (list_.bytes.size() + alignment - 1) / alignment * alignment;
    list_.bytes.resize(offset + size);
    if (size) std::memcpy(list_.bytes.data() + offset, data, size);
    return static_cast<uint32_t>(offset);
}

uint32_t RecorderCore::appendInline(const void* data, uint64_t size, uint64_t alignment, uint64_t padded) {
    const uint64_t offset = (list_.inline_data.size() + alignment - 1) / alignment * alignment;
    list_.inline_data.resize(offset + std::max(size, padded));
    std::byte* place = list_.inline_data.data() + offset;
    if (data) std::memcpy(place, data, size);
    if (padded > size) std::memset(place + size, 0, padded - size);
    return static_cast<uint32_t>(offset);
}

void RecorderCore::barrier(Where where) {
    if (!recording(where) || tracking_) return;
    beginAccesses();
    push<BarrierCommand>(CommandType::Barrier);
}

void RecorderCore::query(CommandType type, const Query& query, Where where) {
    const char* what = type == CommandType::BeginQuery ? "beginQuery" : "endQuery";
    if (!recording(where) || !usable(query, what, where)) return;
    const auto open = std::find(open_queries_.begin(), open_queries_.end(), query);
    if (type == CommandType::BeginQuery) {
        if (open != open_queries_.end())
            return fail(where, ErrorCode::InvalidArgument, "query.begun", "{} has begun already",
                        query.object()->label());
        if (query.getType() == Query::TypeSamples && !graphics_)
            return fail(where, ErrorCode::InvalidArgument, "query.samples",
                        "{} counts samples, which only a Command draws", query.object()->label());
        for (const Query& other : open_queries_)
            if (other.getType() == query.getType() && query.getType() != Query::TypeTime)
                return fail(where, ErrorCode::InvalidArgument, "query.nested",
                            "{} cannot begin within {}: one query of a type at a time, except for time",
                            query.object()->label(), other.object()->label());
        open_queries_.push_back(query);
    } else {
        if (open == open_queries_.end())
            return fail(where, ErrorCode::InvalidArgument, "query.not_begun", "{} has not begun in this recorder",
                        query.object()->label());
        open_queries_.erase(open);
    }
    const size_t known = list_.resources.size();
    const uint32_t index = use(*query.object());
    if (type == CommandType::BeginQuery && list_.resources.size() == known)
        return fail(where, ErrorCode::InvalidArgument, "query.twice",
                    "{} has measured a part of this recorder's list already, and keeps one result",
                    query.object()->label());
    beginAccesses();
    push<QueryCommand>(type).query = index;
}

void RecorderCore::pushRegion(std::string_view name, Where where) {
    if (!recording(where)) return;
    const uint32_t offset = append(nullptr, 0, 1);
    list_.bytes.resize(offset + name.size() + 1);
    std::memcpy(list_.bytes.data() + offset, name.data(), name.size());
    region_depth_++;
    beginAccesses();
    push<RegionCommand>(CommandType::PushRegion).name = offset;
}

void RecorderCore::popRegion(Where where) {
    if (!recording(where)) return;
    if (region_depth_ == 0)
        return fail(where, ErrorCode::InvalidArgument, "recorder.region", "popRegion without pushRegion");
    region_depth_--;
    beginAccesses();
    push<RegionCommand>(CommandType::PopRegion);
}

void RecorderCore::useBuffer(const Buffer& buffer, bool write, Where where) {
    if (!recording(where) || !usableBuffer(buffer, Buffer::FlagAddress, "useBuffer", where)) return;
    const uint32_t resource = use(*buffer.object());
    const auto same = std::find_if(uses_.begin(), uses_.end(), [&](const Use& u) { return u.resource == resource; });
    if (same == uses_.end())
        uses_.push_back({resource, write});
    else
        same->write = same->write || write;
    bindings_dirty_ = true;
}

void RecorderCore::clearUses() {
    uses_.clear();
    bindings_dirty_ = true;
}

}  // namespace glint::detail
