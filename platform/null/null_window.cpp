#include <platform/null/null_window.h>

#include <glint/base/format_error.h>

namespace glint::null {

using namespace detail;

namespace {

constexpr uint32_t picture_count = 3;

Error lostWindow() { return makeError(ErrorCode::Internal, "window.lost", "the window was taken away on request"); }

}  // namespace

NullWindow::NullWindow(std::shared_ptr<NullControl> control, const WindowDesc& desc)
    : NullObject(control, 0, desc.title), control_(std::move(control)), desc_(desc) {
    events_.width = desc.width;
    events_.height = desc.height;
    events_.hidden = desc.hidden;
}

WindowEvents NullWindow::takeEvents() { return events_ = control_->takeWindowEvents(events_); }

void NullWindow::setSize(uint32_t width, uint32_t height) {
    events_.width = width;
    events_.height = height;
}

void NullWindow::setHidden(bool hidden) { events_.hidden = hidden; }

Expected<NativeWindow::Pictures> NullWindow::createPictures() {
    Pictures pictures;
    pictures.sync = desc_.sync;
    pictures.desc = {.type = Texture::Type2D,
                     .format = desc_.srgb ? FormatBGRAu8ns : FormatBGRAu8n,
                     .width = events_.width,
                     .height = events_.height,
                     .flags = Texture::FlagTarget};
    outdated = true;
    if (!events_.width || !events_.height) return pictures;
    NativeTextureDesc native;
    native.desc = pictures.desc;
    native.name = desc_.title;
    for (uint32_t i = 0; i < picture_count; i++) {
        if (Status status = control_->create(NullTexture::size(native)); !status) return unexpected(status.error());
        pictures.textures.push_back(std::make_unique<NullTexture>(control_, native));
    }
    next_ = 0;
    outdated = false;
    return pictures;
}

Expected<uint32_t> NullWindow::acquire() {
    if (control_->isWindowLost()) return unexpected(lostWindow());
    if (control_->takeOutdated()) {
        outdated = true;
        return no_picture;
    }
    return next_++ % picture_count;
}

Status NullWindow::present() {
    control_->present();
    if (control_->isWindowLost()) return lostWindow();
    if (control_->takeOutdated()) outdated = true;
    return {};
}

}  // namespace glint::null
