#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>
#include <cstring>

namespace glint::detail {

namespace {

bool overlap(const Slice& a, const Slice& b) {
    return a.mip < b.mip + b.mips && b.mip < a.mip + a.mips && a.layer < b.layer + b.layers &&
           b.layer < a.layer + a.layers;
}

const char* dimensionName(ImageDimension dimension) {
    switch (dimension) {
        case ImageDimension::None: return "no image";
        case ImageDimension::Image2D: return "2D";
        case ImageDimension::Image3D: return "3D";
        case ImageDimension::Cube: return "cube";
        case ImageDimension::Image2DArray: return "2D array";
        case ImageDimension::CubeArray: return "cube array";
        case ImageDimension::Image2DMultisample: return "2D multisample";
    }
    return "unknown";
}

}  // namespace

RecorderCore::Bound* RecorderCore::bind(SlotKind kind, const Slot& slot, uint32_t step) {
    if (!recording(slot.where_)) return nullptr;
    int64_t index = slot.index_;
    if (slot.name_ || slot.by_binding_) {
        if (!program_) {
            fail(slot.where_, ErrorCode::InvalidArgument, "bind.program",
                 "{} slots are found by name or binding once a kernel or pipeline is set", toString(kind));
            return nullptr;
        }
        index = slot.name_ ? program_->layout.findSlot(kind, slot.name_)
                           : program_->layout.findSlot(kind, slot.set_, slot.binding_);
        if (index < 0) {
            const std::string wanted = slot.name_ ? fmt::format("named '{}'", slot.name_)
                                                  : fmt::format("at set {}, binding {}", slot.set_, slot.binding_);
            fail(slot.where_, ErrorCode::InvalidArgument, "bind.name", "{} has no {} {}", programLabel(),
                 toString(kind), wanted);
            return nullptr;
        }
    }
    auto& slots = bound_[static_cast<size_t>(kind)];
    const ShaderResource* resource = program_ && index >= 0 && index <= INT32_MAX
                                         ? program_->layout.find(kind, static_cast<uint32_t>(index))
                                         : nullptr;
    const bool array = resource && resource->count > 1;
    if (!array) index += step;
    constexpr int64_t limit = 1024;
    if (index < 0 || index >= limit || (array && step >= resource->count)) {
        fail(slot.where_, ErrorCode::OutOfRange, "bind.slot", "{} slot {} element {} is out of range", toString(kind),
             index, step);
        return nullptr;
    }
    if (static_cast<size_t>(index) >= slots.size()) slots.resize(static_cast<size_t>(index) + 1);
    Bound& bound = slots[static_cast<size_t>(index)];
    if (!array) return &bound;
    bound.elements.resize(resource->count);
    return &bound.elements[step];
}

void RecorderCore::setUniformData(const Slot& slot, const void* data, uint64_t size) {
    Bound* bound = bind(SlotKind::Uniform, slot, 0);
    if (!bound) return;
    if (size == 0 || !data)
        return fail(slot.where_, ErrorCode::InvalidArgument, "bind.uniform_size", "setUniform: {} bytes of data", size);
    if (size > device_->features().maxUniformSize)
        return fail(slot.where_, ErrorCode::OutOfRange, "bind.too_large", "setUniform: {} bytes exceed the limit of {}",
                    size, device_->features().maxUniformSize);
    const uint64_t padded = (size + 15) / 16 * 16;
    const uint64_t offset = appendInline(data, size, device_->features().uniformAlignment, padded);
    if (!bound->set || !bound->inlined || bound->value.size != size) bindings_dirty_ = true;
    uniforms_dirty_ = true;
    bound->set = true;
    bound->inlined = true;
    bound->value = {};
    bound->value.offset = offset;
    bound->value.size = size;
}

void RecorderCore::setBuffer(SlotKind kind, const Slot& slot, uint32_t step, const Buffer& buffer, uint64_t offset,
                             uint64_t size, Format format) {
    Bound* bound = bind(kind, slot, step);
    if (!bound) return;
    const Features& features = device_->features();
    const Buffer::Flag flag = kind == SlotKind::Uniform   ? Buffer::FlagUniform
                              : kind == SlotKind::Storage ? Buffer::FlagStorage
                                                          : Buffer::FlagTexel;
    const uint64_t alignment = kind == SlotKind::Uniform   ? features.uniformAlignment
                               : kind == SlotKind::Storage ? features.storageAlignment
                                                           : features.texelAlignment;
    BufferObject* object = usableBuffer(buffer, flag, toString(kind), slot.where_);
    if (!object) return;
    if (offset % alignment)
        return fail(slot.where_, ErrorCode::InvalidArgument, "bind.alignment",
                    "{} {}: offset {} is not a multiple of {}", toString(kind), object->label(), offset, alignment);
    if (offset >= object->size || size > object->size - offset)
        return fail(slot.where_, ErrorCode::OutOfRange, "bind.range",
                    "{}: {} bytes from offset {} exceed {} of {} bytes", toString(kind), size, offset, object->label(),
                    object->size);
    if (size == 0) {
        size = object->size - offset;
        // A uniform block is small; the rest of a large buffer is not part of it.
        if (kind == SlotKind::Uniform) size = std::min(size, features.maxUniformSize);
    }
    const uint64_t limit = kind == SlotKind::Uniform ? features.maxUniformSize : features.maxStorageSize;
    if (size > limit)
        return fail(slot.where_, ErrorCode::OutOfRange, "bind.too_large", "{} {}: {} bytes exceed the limit of {}",
                    toString(kind), object->label(), size, limit);
    const uint32_t resource = use(*object);
    const bool dynamic = kind == SlotKind::Uniform;
    if (!bound->set || bound->inlined || bound->value.resource != resource || bound->value.size != size ||
        bound->value.format != format || (!dynamic && bound->value.offset != offset))
        bindings_dirty_ = true;
    if (dynamic) uniforms_dirty_ = true;
    bound->set = true;
    bound->inlined = false;
    bound->value = {};
    bound->value.resource = resource;
    bound->value.offset = offset;
    bound->value.size = size;
    bound->value.format = format;
}

void RecorderCore::setTexture(SlotKind kind, const Slot& slot, uint32_t step, const Texture& texture, Slice slice) {
    Bound* bound = bind(kind, slot, step);
    if (!bound || !usable(texture, toString(kind), slot.where_)) return;
    auto* object = static_cast<TextureObject*>(texture.object());
    if (kind == SlotKind::Surface) {
        if (!(object->desc.flags & Texture::FlagSurface))
            return fail(slot.where_, ErrorCode::InvalidArgument, "texture.flag",
                        "surface: {} was made without Texture::FlagSurface", object->label());
        if (slice.mips == 0) slice.mips = 1;
        if (slice.mips != 1)
            return fail(slot.where_, ErrorCode::InvalidArgument, "bind.surface_mips",
                        "surface: {} mip levels of {}, a surface has one", slice.mips, object->label());
    }
    if (!resolve(*object, slice, toString(kind), slot.where_)) return;
    const uint32_t resource = use(*object);
    if (bound->set && bound->value.resource == resource && bound->value.slice == slice) return;
    bindings_dirty_ = true;
    bound->set = true;
    bound->value = {};
    bound->value.resource = resource;
    bound->value.slice = slice;
}

void RecorderCore::setSampler(const Slot& slot, uint32_t step, const Sampler& sampler) {
    Bound* bound = bind(SlotKind::Sampler, slot, step);
    if (!bound || !usable(sampler, "sampler", slot.where_)) return;
    const uint32_t resource = use(*sampler.object());
    if (bound->set && bound->value.resource == resource) return;
    bindings_dirty_ = true;
    bound->set = true;
    bound->value = {};
    bound->value.resource = resource;
}

void RecorderCore::setTracing(const Slot& slot, const Tracing& tracing) {
    Bound* bound = bind(SlotKind::Tracing, slot, 0);
    if (!bound || !usable(tracing, "tracing", slot.where_)) return;
    auto* object = static_cast<TracingObject*>(tracing.object());
    if (object->tracing_type != Tracing::TypeInstance)
        return fail(slot.where_, ErrorCode::InvalidArgument, "bind.tracing_type",
                    "{} is a bottom-level structure; shaders trace a top level, made of instances", object->label());
    if (!object->built)
        return fail(slot.where_, ErrorCode::InvalidArgument, "bind.tracing_unbuilt", "{} has not been built",
                    object->label());
    // Dirty even if it is the same structure: what it refers to may have changed.
    bindings_dirty_ = true;
    bound->set = true;
    bound->value = {};
    bound->value.resource = use(*object);
}

void RecorderCore::setTable(const Slot& slot, const Handle& table) {
    Bound* bound = bind(SlotKind::Table, slot, 0);
    if (!bound || !usable(table, "table", slot.where_)) return;
    const uint32_t resource = use(*static_cast<TableObject*>(table.object())->see());
    if (bound->set && bound->value.resource == resource) return;
    bindings_dirty_ = true;
    bound->set = true;
    bound->value = {};
    bound->value.resource = resource;
}

void RecorderCore::setPushData(const void* data, uint64_t size, Where where) {
    if (!recording(where)) return;
    const uint64_t limit = std::min<uint64_t>(push_data_.size(), device_->features().maxPushSize);
    if (size > limit || size % 4)
        return fail(where, ErrorCode::OutOfRange, "bind.push_size",
                    "setPushConstants: {} bytes; the limit is {}, a multiple of 4", size, limit);
    std::memcpy(push_data_.data(), data, size);
    push_size_ = static_cast<uint32_t>(size);
    push_dirty_ = true;
}

void RecorderCore::setProgram(ProgramObject& program) {
    const uint32_t resource = use(program);
    if (program_ == &program) return;
    program_ = &program;
    program_resource_ = resource;
    bindings_dirty_ = uniforms_dirty_ = push_dirty_ = vertices_dirty_ = true;
}

bool RecorderCore::checkTexture(const ShaderResource& resource, const TextureObject& texture,
                                const Slice& slice) const {
    const Texture::Type type = texture.desc.type;
    if ((resource.dimension == ImageDimension::Image2DMultisample) != (texture.samples > 1)) return false;
    switch (resource.dimension) {
        case ImageDimension::Image2D:
        case ImageDimension::Image2DMultisample: return type != Texture::Type3D && slice.layers == 1;
        case ImageDimension::Image2DArray: return type != Texture::Type3D;
        case ImageDimension::Image3D: return type == Texture::Type3D;
        case ImageDimension::Cube: return type == Texture::TypeCube && slice.layers == 6;
        case ImageDimension::CubeArray: return type == Texture::TypeCube && slice.layers % 6 == 0;
        case ImageDimension::None: return false;
    }
    return false;
}

bool RecorderCore::checkBound(const ShaderResource& resource, SlotKind kind, uint32_t slot, Bound& bound,
                              const char* what, Where where) {
    const auto complain = [&]<class... Args>(const char* id, fmt::format_string<Args...> format, Args&&... args) {
        fail(where, ErrorCode::InvalidArgument, id, "{}: {} {} '{}' of {} {}", what, toString(kind), slot,
             resource.name, programLabel(), fmt::format(format, std::forward<Args>(args)...));
        return false;
    };
    if (!bound.set) return complain("bind.unset", "has not been set");
    const BoundResource& value = bound.value;
    const auto label = [&] { return list_.resources[value.resource]->label(); };
    switch (kind) {
        case SlotKind::Uniform: {
            const auto rounded = [](uint64_t size) { return (size + 15) / 16 * 16; };
            if (bound.inlined && rounded(value.size) != rounded(resource.size))
                return complain("bind.uniform_size", "has {} bytes, {} bytes were given", resource.size, value.size);
            if (!bound.inlined && value.size < resource.size)
                return complain("bind.uniform_size", "has {} bytes, {} gives {}", resource.size, label(), value.size);
            return true;
        }
        case SlotKind::Storage:
            if (value.size < resource.size)
                return complain("bind.storage_size", "needs at least {} bytes, {} gives {}", resource.size, label(),
                                value.size);
            return true;
        case SlotKind::Texture:
        case SlotKind::Surface: {
            const auto& texture = *static_cast<const TextureObject*>(list_.resources[value.resource]);
            if (!checkTexture(resource, texture, value.slice))
                return complain("bind.texture_type",
                                "is a {} image; {} gives {} layers of a {} texture with {} samples",
                                dimensionName(resource.dimension), label(), value.slice.layers,
                                texture.desc.type == Texture::Type2D   ? "2D"
                                : texture.desc.type == Texture::Type3D ? "3D"
                                                                       : "cube",
                                texture.samples);
            return true;
        }
        case SlotKind::Tracing: {
            if (!traversal_) return true;
            const auto& tracing = *static_cast<const TracingObject*>(list_.resources[value.resource]);
            // Without any hit record no shader is looked up.
            const uint32_t records = traversal_->countRecords(RayTable::Hit);
            if (records && tracing.built_offset >= records)
                return complain("traversal.hit_record",
                                "is {}, an instance of which has offset {}; there are {} hit records", tracing.label(),
                                tracing.built_offset, records);
            return true;
        }
        case SlotKind::Table:
            return checkTable(resource, static_cast<const TableContents&>(*list_.resources[value.resource]), slot, what,
                              where);
        default: return true;
    }
}

bool RecorderCore::checkTable(const ShaderResource& resource, const TableContents& table, uint32_t slot,
                              const char* what, Where where) {
    const auto complain = [&](const char* id, const std::string& text) {
        fail(where, ErrorCode::InvalidArgument, id, "{}: table {} '{}' of {} {}", what, slot, resource.name,
             programLabel(), text);
        return false;
    };
    if (table.element != resource.element)
        return complain("bind.table", fmt::format("holds {} entries, {} holds {} ones", toString(resource.element),
                                                  table.label(), toString(table.element)));
    for (size_t i = 0; i < table.entries.size(); i++) {
        const TableContents::Entry& entry = table.entries[i];
        if (!entry.object) continue;
        const bool is_texture = table.element == SlotKind::Texture;
        // Aliases of several dimensions: each shader knows which entries are of its own.
        if (is_texture && resource.dimension != ImageDimension::None &&
            !checkTexture(resource, static_cast<const TextureObject&>(*entry.object), entry.slice))
            return complain("bind.texture_type",
                            fmt::format("holds {} images; entry {} of {}, {} with {} layers, is none",
                                        dimensionName(resource.dimension), i, table.label(), entry.object->label(),
                                        entry.slice.layers));
        if (!is_texture && entry.size < resource.size)
            return complain("bind.storage_size",
                            fmt::format("needs at least {} bytes; entry {} of {}, {}, gives {}", resource.size, i,
                                        table.label(), entry.object->label(), entry.size));
    }
    return true;
}

void RecorderCore::accessTable(const ShaderResource& resource, const TableContents& table) {
    const bool is_texture = table.element == SlotKind::Texture;
    const auto flags = static_cast<uint8_t>((resource.read ? AccessRead : 0) | (resource.write ? AccessWrite : 0));
    for (const TableContents::Entry& entry : table.entries) {
        if (!entry.object) continue;
        const uint32_t index = use(*entry.object);
        forEachStage(resource.stages, [&](Stage stage) {
            if (is_texture)
                access(index, stage, AccessRead, Layout::Sampled, entry.slice);
            else
                access(index, stage, flags ? flags : static_cast<uint8_t>(AccessRead));
        });
    }
}

void RecorderCore::accessBound(const ShaderResource& resource, SlotKind kind, const Bound& bound) {
    if (kind == SlotKind::Sampler || bound.inlined) return;
    if (kind == SlotKind::Table)
        return accessTable(resource, static_cast<const TableContents&>(*list_.resources[bound.value.resource]));
    const uint32_t index = bound.value.resource;
    const auto flags = static_cast<uint8_t>((resource.read ? AccessRead : 0) | (resource.write ? AccessWrite : 0));
    forEachStage(resource.stages, [&](Stage stage) {
        switch (kind) {
            case SlotKind::Texture: access(index, stage, AccessRead, Layout::Sampled, bound.value.slice); break;
            case SlotKind::Surface:
                access(index, stage, flags ? flags : static_cast<uint8_t>(AccessRead), Layout::General,
                       bound.value.slice);
                break;
            case SlotKind::Tracing:
                access(index, stage, AccessRead);
                for (const Ref<TracingObject>& reference :
                     static_cast<TracingObject*>(list_.resources[index])->built_references)
                    access(use(*reference), stage, AccessRead);
                break;
            case SlotKind::Uniform: access(index, stage, AccessRead); break;
            default: access(index, stage, flags ? flags : static_cast<uint8_t>(AccessRead)); break;
        }
    });
}

bool RecorderCore::flushBindings(const char* what, Where where) {
    if (!bindings_dirty_ && !uniforms_dirty_) return true;
    const BindingLayout& layout = program_->layout;
    // Written in place, once there is room for all: growing moves what came before.
    if (bindings_dirty_) {
        bindings_.bound = room(program_->element_count * sizeof(BoundResource), alignof(BoundResource));
        bindings_.bound_count = program_->element_count;
        first_shared_ = static_cast<uint32_t>(list_.accesses.size());
    }
    bindings_.uniform_offsets = room(program_->uniform_elements * sizeof(uint32_t), alignof(uint32_t));
    bindings_.uniform_count = program_->uniform_elements;
    std::span<BoundResource> elements;
    uint32_t* offsets = nullptr;
    if (bindings_.bound != none)
        elements = {reinterpret_cast<BoundResource*>(list_.bytes.data() + bindings_.bound), bindings_.bound_count};
    if (bindings_.uniform_offsets != none)
        offsets = reinterpret_cast<uint32_t*>(list_.bytes.data() + bindings_.uniform_offsets);
    if (bindings_dirty_)
        for (BoundResource& element : elements) element.second = none;

    Bound unset;
    for (size_t k = 0; k < layout.slots.size(); k++) {
        const auto kind = static_cast<SlotKind>(k);
        if (!bindings_dirty_ && kind != SlotKind::Uniform && kind != SlotKind::Tracing) continue;
        for (uint32_t slot = 0; slot < layout.slots[k].size(); slot++) {
            const uint32_t index = layout.slots[k][slot];
            const ShaderResource& resource = layout.resources[index];
            auto& slots = bound_[k];
            if (slot >= slots.size()) slots.resize(layout.slots[k].size());
            const bool in_software = resource.isRewritten();
            if (kind == SlotKind::Tracing && !bindings_dirty_ && !in_software) continue;
            const uint32_t count = kind == SlotKind::Table ? 1 : resource.count;
            for (uint32_t e = 0; e < count; e++) {
                Bound& bound = count == 1                        ? slots[slot]
                               : e < slots[slot].elements.size() ? slots[slot].elements[e]
                                                                 : unset;
                if (bindings_dirty_ && !checkBound(resource, kind, slot, bound, what, where)) return false;
                if (kind == SlotKind::Uniform)
                    offsets[program_->first_uniform[index] + e] = static_cast<uint32_t>(bound.value.offset);
                if (!bindings_dirty_) continue;
                if (in_software) {
                    accessBound(resource, kind, bound);
                    continue;
                }
                BoundResource& element = elements[program_->first_element[index] + e];
                if (kind == SlotKind::Sampler && resource.combined) {
                    element.second = bound.value.resource;
                } else {
                    const uint32_t second = element.second;
                    element = bound.value;
                    element.second = second;
                    if (kind == SlotKind::Uniform) {
                        element.offset = 0;
                        element.size = std::max<uint64_t>(resource.size, 1);
                    }
                }
                accessBound(resource, kind, bound);
            }
            if (!in_software) continue;
            if (bindings_dirty_) {
                BoundResource& block = elements[program_->first_element[index]];
                block = {};
                block.size = bindReferences(resource, slots[slot]);
            }
            offsets[program_->first_uniform[index]] = slots[slot].references;
        }
    }
    bindHidden(elements, offsets);

    if (bindings_dirty_) {
        for (const Use& buffer : uses_)
            forEachStage(program_->layout.stages, [&](Stage stage) {
                access(buffer.resource, stage,
                       static_cast<uint8_t>(buffer.write ? AccessRead | AccessWrite : AccessRead));
            });
        shared_count_ = static_cast<uint32_t>(list_.accesses.size()) - first_shared_;
        const std::span shared(list_.accesses.data() + first_shared_, shared_count_);
        // Surfaces are few, the textures of a table many.
        for (const Access& surface : shared) {
            if (surface.layout != Layout::General) continue;
            for (const Access& texture : shared)
                if (texture.layout == Layout::Sampled && texture.resource == surface.resource &&
                    overlap(texture.slice, surface.slice)) {
                    fail(where, ErrorCode::InvalidArgument, "bind.layout_conflict",
                         "{}: {} is bound both as texture and as surface", what,
                         list_.resources[surface.resource]->label());
                    return false;
                }
        }
    }
    bindings_dirty_ = uniforms_dirty_ = false;
    return true;
}

bool RecorderCore::flushPush(const char* what, Where where) {
    const uint32_t wanted = program_->layout.push_size;
    if (wanted > push_size_) {
        fail(where, ErrorCode::InvalidArgument, "bind.push_size",
             "{}: the push constants of {} have {} bytes, {} bytes were given", what, programLabel(), wanted,
             push_size_);
        return false;
    }
    if (!push_dirty_) return true;
    bindings_.push = wanted ? append(push_data_.data(), wanted, 4) : none;
    bindings_.push_size = wanted;
    push_dirty_ = false;
    return true;
}

void RecorderCore::shareAccesses(CommandHeader& header) const {
    header.first_shared = first_shared_;
    header.shared_count = shared_count_;
}

}  // namespace glint::detail
