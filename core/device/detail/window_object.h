#pragma once

#include <glint/device/detail/device_object.h>
#include <glint/device/detail/target_object.h>
#include <glint/device/window.h>

#include <array>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace glint::detail {

/// The object behind Window: takes pictures from the back end's window, gives them to its target, hands them back.
class WindowObject final : public Object {
public:
    using Where = std::source_location;

    WindowObject(DeviceObject* device, const WindowDesc& desc);

    /// After the native window is there. An error makes the window fail.
    void open(Where where);

    bool update(Where where);
    bool render(Where where);
    Status present(Where where);
    Status finish(Where where);
    /// A picture that nobody has drawn to gets the clear colour, rather than what the memory holds.
    Status clearUndrawn(Where where);
    void resize(uint32_t width, uint32_t height, Where where);
    /// An error, which has been told, if the window is not ready or this is not its thread.
    Status check(const char* what, Where where);

    NativeWindow& nativeWindow() const { return *static_cast<NativeWindow*>(native.get()); }
    TextureObject* picture() const { return picture_.get(); }
    TargetObject& target() const { return *target_; }
    const WindowDesc& desc() const { return desc_; }
    const TextureDesc& pictureDesc() const { return picture_desc_; }
    WindowDesc::Sync sync() const { return sync_; }
    const WindowEvents& events() const { return events_; }

    bool closed = false;
    std::function<bool()> close_callback;

private:
    void lastRelease() override;
    /// New pictures and a new depth texture. False if there are none; an error makes the window fail.
    bool renew(Where where);
    void dropPictures();
    void endFrame();
    Status waitFrame(size_t frame, Where where);

    const WindowDesc desc_;
    const std::thread::id thread_;
    Ref<TargetObject> target_;
    std::vector<Ref<TextureObject>> pictures_;
    TextureDesc picture_desc_;
    WindowDesc::Sync sync_ = WindowDesc::Sync::Vertical;
    Ref<TextureObject> picture_;  ///< of the frame
    WindowEvents events_;
    uint32_t renewed_width_ = 0;  ///< what the events said when the pictures were made
    uint32_t renewed_height_ = 0;
    bool was_skipped_ = false;  ///< by the last render()
    size_t frame_ = 0;
    std::array<Ref<FenceObject>, frames_in_flight> fences_;  ///< of the last frames' presentation
};

}  // namespace glint::detail
