#pragma once

// Windows of the desktop, through GLFW. The window system is opened by the first window and closed after the last one.

#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <vulkan/vulkan_core.h>

#include <glint/base/expected.h>
#include <glint/device/detail/backend.h>

#include <memory>
#include <string>

struct GLFWwindow;

namespace glint::window {

/// All methods from the thread that made the first window; it may be deleted on any.
class SystemWindow {
public:
    /// Errors: "window.no_display", "window.create", "window.thread".
    static Expected<std::unique_ptr<SystemWindow>> create(const WindowDesc& desc);
    /// Gives the window back to the system, at the next occasion if this is another thread.
    ~SystemWindow();
    SystemWindow(const SystemWindow&) = delete;
    SystemWindow& operator=(const SystemWindow&) = delete;

    /// The caller destroys it, before the window. Errors: "window.unsupported".
    Expected<VkSurfaceKHR> createSurface(VkInstance instance) const;

    /// Delivers the events of all windows. If none of them is shown it sleeps until there are some, but no longer than
    /// this.
    static void poll(uint64_t nanoseconds);
    /// What happened since the last call.
    detail::WindowEvents takeEvents();
    /// Of the picture, in pixels.
    Vector2u size() const;

    void setTitle(const std::string& title);
    void setSize(uint32_t width, uint32_t height);
    void setHidden(bool hidden);

private:
    friend struct Callbacks;

    explicit SystemWindow(GLFWwindow* handle) : handle_(handle) {}
    bool isHidden() const;

    GLFWwindow* const handle_;
    detail::WindowEvents events_;
};

}  // namespace glint::window
