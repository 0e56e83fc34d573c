#include <glint/device/target.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/target_object.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>

namespace glint {

namespace {

using detail::TargetObject;
using detail::TextureObject;

/// Checks a texture for use as attachment and stores it; `what` names the place for messages.
void attach(TargetObject& target, detail::Ref<TextureObject>& place, Slice& place_slice, const Texture& texture,
            Slice slice, bool depth, const char* what, std::source_location where) {
    if (texture.state() == ObjectState::Null) {
        place = {};
        return;
    }
    if (!texture) {
        target.fail(makeError(where, ErrorCode::InvalidArgument, "target.texture", "{}: the {} texture failed: {}",
                              target.label(), what, texture.error().message()));
        return;
    }
    auto* object = static_cast<TextureObject*>(texture.object());
    if (object->device() != target.device()) {
        target.fail(makeError(where, ErrorCode::InvalidArgument, "handle.device", "{}: {} belongs to another device",
                              target.label(), object->label()));
        return;
    }
    const FormatInfo& info = formatInfo(object->desc.format);
    if (!(object->desc.flags & Texture::FlagTarget)) {
        target.fail(makeError(where, ErrorCode::InvalidArgument, "target.flag",
                              "{}: the {} {} was made without Texture::FlagTarget", target.label(), what,
                              object->label()));
        return;
    }
    if (info.depth != depth) {
        target.fail(makeError(where, ErrorCode::InvalidArgument, "target.format",
                              "{}: {} has format {}, which is no {} format", target.label(), object->label(), info.name,
                              depth ? "depth" : "colour"));
        return;
    }
    if (slice.mips == 0) slice.mips = 1;
    if (!detail::resolveSlice(object->desc, slice) || slice.mips != 1) {
        target.fail(
            makeError(where, ErrorCode::OutOfRange, "target.slice",
                      "{}: {} has {} mip levels and {} layers; the slice asks for {} levels from {}, {} layers from {}",
                      target.label(), object->label(), object->desc.mipmaps, object->desc.layers, slice.mips, slice.mip,
                      slice.layers, slice.layer));
        return;
    }
    place = detail::Ref<TextureObject>(object);
    place_slice = slice;
}

TargetObject* indexed(detail::Object* object, uint32_t index, std::source_location where) {
    auto* target = static_cast<TargetObject*>(object);
    if (!target) return nullptr;
    const uint32_t limit = std::min(target->device()->features().maxTargets, detail::max_targets);
    if (index < limit) return target;
    target->fail(makeError(where, ErrorCode::OutOfRange, "target.index", "{}: colour texture {} of at most {}",
                           target->label(), index, limit));
    return nullptr;
}

}  // namespace

void Target::setColorTexture(uint32_t index, const Texture& texture, const Slice& slice, Where where) {
    TargetObject* target = indexed(object_, index, where);
    if (target)
        attach(*target, target->colors[index].texture, target->colors[index].slice, texture, slice, false, "colour",
               where);
}

void Target::setColorResolve(uint32_t index, const Texture& texture, const Slice& slice, Where where) {
    TargetObject* target = indexed(object_, index, where);
    if (target)
        attach(*target, target->colors[index].resolve, target->colors[index].resolve_slice, texture, slice, false,
               "resolve", where);
}

void Target::setDepthTexture(const Texture& texture, const Slice& slice, Where where) {
    auto* target = static_cast<TargetObject*>(object_);
    if (target) attach(*target, target->depth.texture, target->depth.slice, texture, slice, true, "depth", where);
}

void Target::setDepthResolve(const Texture& texture, const Slice& slice, Where where) {
    auto* target = static_cast<TargetObject*>(object_);
    if (target)
        attach(*target, target->depth.resolve, target->depth.resolve_slice, texture, slice, true, "resolve", where);
}

void Target::setColorOperation(uint32_t index, uint8_t operation) {
    TargetObject* target = indexed(object_, index, Where::current());
    if (target) target->colors[index].operation = operation;
}

void Target::setDepthOperation(uint8_t operation) {
    if (object_) static_cast<TargetObject*>(object_)->depth.operation = operation;
}

void Target::setClearColor(uint32_t index, const Color& color) {
    TargetObject* target = indexed(object_, index, Where::current());
    if (target) target->colors[index].clear = color;
}

void Target::setClearDepth(float depth, uint32_t stencil, Where where) {
    auto* target = static_cast<TargetObject*>(object_);
    if (!target) return;
    if (!(depth >= 0 && depth <= 1)) {
        target->fail(makeError(where, ErrorCode::OutOfRange, "clear.depth", "{}: depth {}; it is 0 to 1",
                               target->label(), depth));
        return;
    }
    target->clear_depth = depth;
    target->clear_stencil = stencil;
}

namespace {

uint32_t smallest(detail::Object* object, uint32_t TextureDesc::*size) {
    if (!object) return 0;
    const auto* target = static_cast<TargetObject*>(object);
    uint32_t result = UINT32_MAX;
    const auto consider = [&](const TargetObject::Attachment& attachment) {
        if (attachment.texture)
            result = std::min(result, detail::mipSize(attachment.texture->desc.*size, attachment.slice.mip));
    };
    for (const auto& color : target->colors) consider(color);
    consider(target->depth);
    return result == UINT32_MAX ? 0 : result;
}

}  // namespace

uint32_t Target::getWidth() const { return smallest(object_, &TextureDesc::width); }
uint32_t Target::getHeight() const { return smallest(object_, &TextureDesc::height); }

}  // namespace glint
