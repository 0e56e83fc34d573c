#include <glint/device/detail/window_object.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/recorder_core.h>

#include <utility>

namespace glint::detail {

namespace {

/// How long update() sleeps at most while nothing is to be seen, nanoseconds.
constexpr uint64_t idle_time = 100'000'000;

}  // namespace

WindowObject::WindowObject(DeviceObject* device, const WindowDesc& desc)
    : Object(ObjectType::Window, device), desc_(desc), thread_(std::this_thread::get_id()) {}

void WindowObject::open(Where where) {
    target_ = Ref<TargetObject>::adopt(new TargetObject(device()));
    target_->setName(desc_.title);
    target_->is_window = true;
    target_->colors[0].slice = target_->depth.slice = {0, 1, 0, 1};
    target_->setReady();
    for (Ref<FenceObject>& fence : fences_) fence = Ref<FenceObject>::adopt(new FenceObject(device()));
    events_ = nativeWindow().takeEvents();
    (void)renew(where);
}

Status WindowObject::check(const char* what, Where where) {
    if (state() != ObjectState::Ready) return error().at(where);
    if (std::this_thread::get_id() == thread_) return {};
    const Error error = makeError(where, ErrorCode::InvalidArgument, "window.thread",
                                  "{}: {} is used by another thread than the one that made it", what, label());
    device()->report(error);
    return error;
}

bool WindowObject::update(Where where) {
    if (!check("update", where)) return false;
    nativeWindow().poll(was_skipped_ ? idle_time : 0);
    events_ = nativeWindow().takeEvents();
    if (events_.close) {
        const Ref<WindowObject> keep_alive(this);  // the callback may let go of the last handle
        closed = closed || !close_callback || close_callback();
        return !closed;
    }
    return !closed;
}

bool WindowObject::render(Where where) {
    if (!check("render", where)) return false;
    if (picture_) return true;
    was_skipped_ = true;
    if (events_.hidden || !events_.width || !events_.height) return false;
    if (const Status status = waitFrame(frame_, where); !status) {
        keep(status.error());
        return false;
    }
    // A window that is being resized may be outdated again as soon as it has been renewed.
    for (int attempt = 0; attempt < 3 && !picture_; attempt++) {
        const bool resized = events_.width != renewed_width_ || events_.height != renewed_height_;
        if ((resized || nativeWindow().outdated) && !renew(where)) return false;
        const Expected<uint32_t> next = nativeWindow().acquire();
        if (!next) {
            fail(next.error().at(where));
            return false;
        }
        if (*next != NativeWindow::no_picture) picture_ = pictures_[*next];
        if (!picture_ && !nativeWindow().outdated) return false;
    }
    if (!picture_) return false;
    device()->setAcquired(*picture_, &nativeWindow());
    target_->colors[0].texture = picture_;
    was_skipped_ = false;
    return true;
}

Status WindowObject::present(Where where) {
    if (Status status = check("present", where); !status) return status;
    if (!picture_) {
        const Error error = makeError(where, ErrorCode::InvalidArgument, "window.no_frame",
                                      "present: {} has no picture to show: render() comes first", label());
        device()->report(error);
        return error;
    }
    if (Status status = clearUndrawn(where); !status) return status;
    const RecorderPtr recorder = device()->acquireRecorder(Queue::Main, "present");
    recorder->presentPicture(*picture_);
    RecorderCore* const lists[] = {recorder.get()};
    FenceObject& fence = *fences_[frame_ % fences_.size()];
    Status status = device()->submit(lists, &fence, where, &nativeWindow());
    const bool is_lost =
        !status && (status.error().code() == ErrorCode::DeviceLost || status.error().id() == "window.lost");
    if (is_lost) keep(status.error());
    if (status || is_lost) {
        endFrame();
        frame_++;
    }
    return status;
}

Status WindowObject::clearUndrawn(Where where) {
    if (device()->isAwaited(*picture_)) return {};
    const RecorderPtr recorder = device()->acquireRecorder(Queue::Main, "clear");
    recorder->beginTarget(*target_, where);
    RecorderCore* const lists[] = {recorder.get()};
    return device()->submit(lists, nullptr, where);
}

Status WindowObject::finish(Where where) {
    if (Status status = check("finish", where); !status) return status;
    for (size_t i = 0; i < frames_in_flight; i++)
        if (Status status = waitFrame(i, where); !status) return status;
    return {};
}

Status WindowObject::waitFrame(size_t frame, Where where) {
    FenceObject& fence = *fences_[frame % fences_.size()];
    std::array<uint64_t, queue_count> values;
    {
        std::lock_guard lock(fence.mutex);
        values = fence.values;
    }
    return device()->wait(values, UINT64_MAX, where);
}

void WindowObject::resize(uint32_t width, uint32_t height, Where where) {
    if (!check("setSize", where)) return;
    const uint32_t limit = device()->features().maxTexture2DSize;
    if (width && height && width <= limit && height <= limit) return nativeWindow().setSize(width, height);
    device()->report(makeError(where, ErrorCode::OutOfRange, "window.size",
                               "setSize: {} cannot have {}x{} pixels; each is 1 to {}", label(), width, height, limit));
}

bool WindowObject::renew(Where where) {
    Expected<NativeWindow::Pictures> made = nativeWindow().createPictures();
    if (!made) {
        fail(made.error().at(where));
        return false;
    }
    dropPictures();
    renewed_width_ = events_.width;
    renewed_height_ = events_.height;
    picture_desc_ = made->desc;
    sync_ = made->sync;
    for (size_t i = 0; i < made->textures.size(); i++) {
        auto picture = Ref<TextureObject>::adopt(new TextureObject(device()));
        picture->setName(fmt::format("{}, picture {}", desc_.title, i));
        picture->desc = made->desc;
        picture->uses.resize(1);
        picture->is_picture = true;
        picture->native = std::move(made->textures[i]);
        picture->native->setName(picture->name());
        picture->setReady();
        pictures_.push_back(std::move(picture));
    }
    if (pictures_.empty()) return false;
    if (desc_.depth != FormatUnknown) {
        device()->retain();
        Device handle(device());
        const Texture depth = handle.createTexture2D(desc_.depth, picture_desc_.width, picture_desc_.height,
                                                     Texture::FlagTarget, desc_.title + ", depth", where);
        if (!depth) {
            keep(depth.error());
            return false;
        }
        target_->depth.texture = Ref<TextureObject>(static_cast<TextureObject*>(depth.object()));
    }
    return true;
}

void WindowObject::dropPictures() {
    // Handles and lists may keep the object; what they submit is refused, because it is not acquired.
    for (const Ref<TextureObject>& picture : pictures_) device()->replaceNative(*picture, nullptr);
    pictures_.clear();
    target_->depth.texture = {};
}

void WindowObject::endFrame() {
    if (!picture_) return;
    device()->setAcquired(*picture_, nullptr);
    picture_ = {};
    target_->colors[0].texture = {};
}

void WindowObject::lastRelease() {
    if (!native) return;
    endFrame();
    for (size_t i = 0; i < frames_in_flight && fences_[i]; i++) (void)waitFrame(i, Where::current());
    for (const Ref<TextureObject>& picture : pictures_) device()->waitUnused(*picture);
    if (target_) dropPictures();
    device()->collect();
    native.reset();
}

}  // namespace glint::detail
