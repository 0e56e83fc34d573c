#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/device/handle.h>
#include <glint/device/target.h>
#include <glint/device/texture.h>
#include <glint/math/math.h>

#include <cstdint>
#include <functional>
#include <source_location>
#include <string>
#include <string_view>

namespace glint {

class Image;

/// How a Window is made.
struct WindowDesc {
    /// When a picture is shown. What the system lacks becomes the next one in the order Off, Mailbox, Vertical.
    enum class Sync : uint8_t {
        Vertical,  ///< at the screen's next refresh, in order: no tearing, and no more pictures than the screen shows
        Mailbox,   ///< at the screen's next refresh, the newest one: no tearing, as many pictures as can be drawn
        Off,       ///< at once
    };

    std::string title = "Glint";
    uint32_t width = 1600;  ///< of the picture, in the system's units, which are pixels on most
    uint32_t height = 900;
    bool resizable = true;         ///< by the user; setSize() always works
    bool hidden = false;           ///< until setHidden(false)
    bool srgb = false;             ///< the picture takes linear colours and stores them as sRGB
    Format depth = FormatUnknown;  ///< of the depth texture that the window's target gets; FormatUnknown for none
    Sync sync = Sync::Vertical;
};

/// A window of the desktop whose picture is a Target. Created by Device::createWindow, of a device with FeaturePresent
/// (which every device has whose adapter can present).
///
///     while (window.update()) {
///         if (!window.render()) continue;
///         Command command = device.createCommand(window.getTarget());
///         ...
///         if (!device.submit(command) || !window.present()) break;
///     }
///     if (!window) report(window.error());
///
/// All windows of a process belong to the thread that made the first of them: every method here is called from that
/// thread ("window.thread"). Handles may be copied and released from any.
class Window : public Handle {
public:
    using Where = std::source_location;

    /// Keys by what they stand for on a US keyboard. Letters and digits are their own capital: isKeyDown('W').
    enum Key : uint8_t {
        KeyNone = 0,
        KeySpace = ' ',
        KeyEscape = 128,
        KeyEnter,
        KeyTab,
        KeyBackspace,
        KeyInsert,
        KeyDelete,
        KeyLeft,
        KeyRight,
        KeyUp,
        KeyDown,
        KeyPageUp,
        KeyPageDown,
        KeyHome,
        KeyEnd,
        KeyShift,  ///< left or right, as the next three
        KeyControl,
        KeyAlt,
        KeySuper,
        KeyF1,  ///< to KeyF1 + 11
        KeyCount = KeyF1 + 12,
    };
    enum Button : uint8_t { ButtonLeft, ButtonRight, ButtonMiddle, ButtonCount };

    Window() = default;
    explicit Window(detail::Object* object) : Handle(object) {}

    // The loop.

    /// Takes what has happened since the last call. False once the window is closed or has failed. While no window of
    /// the process is to be seen it sleeps for up to a tenth of a second, so that the loop does not spin.
    bool update(Where where = Where::current());
    /// Begins a picture: getTarget() and getTexture() stand for it until present(). False if there is nothing to draw
    /// into now: the window is hidden, minimised or has failed. Waits if two pictures are under way. A picture that was
    /// begun and not presented goes on.
    bool render(Where where = Where::current());
    /// Shows the picture once all that was submitted is drawn. Errors: "window.no_frame", "window.lost".
    Status present(Where where = Where::current());
    /// The loop of a program with one window: calls `frame` for each picture, between render() and present(), until the
    /// window is closed. Returns the first error, of `frame` or of the window.
    Status run(const std::function<Status()>& frame, Where where = Where::current());
    /// Waits until all pictures so far are drawn.
    Status finish(Where where = Where::current());

    /// Ends the loop: the next update() returns false.
    void close();
    /// Asked when the user wants to close the window; false keeps it open.
    void setCloseCallback(std::function<bool()> callback);

    // The picture.

    /// Has the picture, and the depth texture, while there is one. Clear colours and operations that are set on it
    /// stay.
    Target getTarget() const;
    /// The picture of the frame, null outside of one. Besides drawing it may be copied from and to where the system
    /// allows it; lists that use it are for Queue::Main ("window.queue").
    Texture getTexture() const;
    /// For Pipeline::setColorFormat and setDepthFormat: RGBA or BGRA of 8 bits, sRGB or not.
    Format getColorFormat() const;
    Format getDepthFormat() const;
    /// Pixels of the picture.
    uint32_t getWidth() const;
    uint32_t getHeight() const;
    /// What it came to.
    WindowDesc::Sync getSync() const;
    /// What was submitted for this picture so far, as FormatRGBAu8n or FormatRGBAu8ns; waits for it. Errors:
    /// "window.no_frame", "texture.flag" where the system does not let windows be read.
    Expected<Image> grab(Where where = Where::current());

    // The window.

    bool isClosed() const;
    bool isFocused() const;
    /// Hidden or minimised.
    bool isHidden() const;
    std::string getTitle() const;
    void setTitle(std::string_view title, Where where = Where::current());
    /// As WindowDesc has it. Errors: "window.size".
    void setSize(uint32_t width, uint32_t height, Where where = Where::current());
    void setHidden(bool hidden, Where where = Where::current());

    // The user, as of the last update().

    bool isKeyDown(int key) const;
    /// Went down, or was repeated, since the update() before.
    bool isKeyPressed(int key) const;
    /// What was typed since the update() before, UTF-8.
    const std::string& getText() const;
    bool isMouseDown(Button button) const;
    bool isMousePressed(Button button) const;
    /// In pixels from the top left corner of the picture; may lie outside.
    Vector2f getMouse() const;
    /// Clicks of the wheel since the update() before: y is positive away from the user.
    Vector2f getWheel() const;
};

}  // namespace glint
