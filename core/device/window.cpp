#include <glint/device/window.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/window_object.h>
#include <glint/format/image.h>

namespace glint {

namespace {

using detail::WindowObject;

WindowObject* ready(const Window& window) { return window ? static_cast<WindowObject*>(window.object()) : nullptr; }

/// Of any window that has been made, a failed one included.
const detail::WindowEvents& events(const Window& window) {
    static const detail::WindowEvents none;
    return window.object() ? static_cast<WindowObject*>(window.object())->events() : none;
}

bool test(const auto& bits, int index) { return index >= 0 && static_cast<size_t>(index) < bits.size() && bits[index]; }

}  // namespace

bool Window::update(Where where) {
    WindowObject* window = ready(*this);
    return window && window->update(where);
}

bool Window::render(Where where) {
    WindowObject* window = ready(*this);
    return window && window->render(where);
}

Status Window::present(Where where) {
    WindowObject* window = ready(*this);
    return window ? window->present(where) : Status(error().at(where));
}

Status Window::run(const std::function<Status()>& frame, Where where) {
    if (WindowObject* window = ready(*this)) {
        if (Status status = window->check("run", where); !status) return status;
    }
    while (update(where)) {
        if (!render(where)) continue;
        if (Status status = frame(); !status) return status;
        if (Status status = present(where); !status) return status;
    }
    return *this ? Status() : Status(error().at(where));
}

Status Window::finish(Where where) {
    WindowObject* window = ready(*this);
    return window ? window->finish(where) : Status(error().at(where));
}

void Window::close() {
    if (WindowObject* window = ready(*this)) window->closed = true;
}

void Window::setCloseCallback(std::function<bool()> callback) {
    if (WindowObject* window = ready(*this)) window->close_callback = std::move(callback);
}

Target Window::getTarget() const {
    WindowObject* window = ready(*this);
    if (!window) return Target();
    window->target().retain();
    return Target(&window->target());
}

Texture Window::getTexture() const {
    WindowObject* window = ready(*this);
    if (!window || !window->picture()) return Texture();
    window->picture()->retain();
    return Texture(window->picture());
}

Format Window::getColorFormat() const {
    const WindowObject* window = ready(*this);
    return window ? window->pictureDesc().format : FormatUnknown;
}

Format Window::getDepthFormat() const {
    const WindowObject* window = ready(*this);
    return window ? window->desc().depth : FormatUnknown;
}

uint32_t Window::getWidth() const {
    const WindowObject* window = ready(*this);
    return window ? window->pictureDesc().width : 0;
}

uint32_t Window::getHeight() const {
    const WindowObject* window = ready(*this);
    return window ? window->pictureDesc().height : 0;
}

WindowDesc::Sync Window::getSync() const {
    const WindowObject* window = ready(*this);
    return window ? window->sync() : WindowDesc::Sync::Vertical;
}

Expected<Image> Window::grab(Where where) {
    WindowObject* window = ready(*this);
    if (!window) return unexpected(error().at(where));
    if (Status status = window->check("grab", where); !status) return unexpected(status.error());
    const Texture picture = getTexture();
    if (!picture) {
        const Error none = makeError(where, ErrorCode::InvalidArgument, "window.no_frame",
                                     "grab: {} has a picture between render() and present() only", window->label());
        window->device()->report(none);
        return unexpected(none);
    }
    if (Status status = window->clearUndrawn(where); !status) return unexpected(status.error());
    Expected<Image> image = Image::create(picture.getFormat(), picture.getWidth(), picture.getHeight());
    if (!image) return unexpected(image.error().at(where));
    window->device()->retain();
    Device device(window->device());
    const std::span<std::byte> bytes = image->bytes();
    if (Status status = device.getTexture(picture, bytes.data(), bytes.size(), {}, where); !status)
        return unexpected(status.error());
    return image->convert(formatInfo(picture.getFormat()).srgb ? FormatRGBAu8ns : FormatRGBAu8n);
}

bool Window::isClosed() const {
    const WindowObject* window = ready(*this);
    return !window || window->closed;
}

bool Window::isFocused() const { return events(*this).focused; }
bool Window::isHidden() const { return events(*this).hidden; }

std::string Window::getTitle() const { return name(); }

void Window::setTitle(std::string_view title, Where where) {
    WindowObject* window = ready(*this);
    if (!window || !window->check("setTitle", where)) return;
    window->setName(title);
    window->nativeWindow().setTitle(std::string(title));
}

void Window::setSize(uint32_t width, uint32_t height, Where where) {
    if (WindowObject* window = ready(*this)) window->resize(width, height, where);
}

void Window::setHidden(bool hidden, Where where) {
    WindowObject* window = ready(*this);
    if (window && window->check("setHidden", where)) window->nativeWindow().setHidden(hidden);
}

bool Window::isKeyDown(int key) const { return test(events(*this).keys, key); }
bool Window::isKeyPressed(int key) const { return test(events(*this).pressed_keys, key); }
const std::string& Window::getText() const { return events(*this).text; }
bool Window::isMouseDown(Button button) const { return test(events(*this).buttons, button); }
bool Window::isMousePressed(Button button) const { return test(events(*this).pressed_buttons, button); }
Vector2f Window::getMouse() const { return events(*this).mouse; }
Vector2f Window::getWheel() const { return events(*this).wheel; }

}  // namespace glint
