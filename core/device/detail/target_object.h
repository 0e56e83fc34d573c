#pragma once

#include <glint/device/detail/object.h>
#include <glint/device/target.h>

namespace glint::detail {

class TargetObject final : public Object {
public:
    explicit TargetObject(DeviceObject* device) : Object(ObjectType::Target, device) {}

    struct Attachment {
        Ref<TextureObject> texture;
        Ref<TextureObject> resolve;
        Slice slice;  ///< resolved
        Slice resolve_slice;
        uint8_t operation = Target::OpDefault;
        Color clear = Color::black();
    };

    Attachment colors[max_targets];
    Attachment depth;
    bool is_window = false;  ///< has textures only while the window has a frame
    float clear_depth = 1.0f;
    uint32_t clear_stencil = 0;
};

}  // namespace glint::detail
