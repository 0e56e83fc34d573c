#include "platform/window/system_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <vector>

namespace glint::window {

using namespace detail;

namespace {

/// The process's connection to the window system.
struct System {
    std::mutex mutex;  // of all members
    bool is_open = false;
    std::thread::id thread;
    std::vector<SystemWindow*> windows;
    std::vector<GLFWwindow*> orphans;  ///< whose owner was deleted on another thread
};

System& system() {
    static System instance;
    return instance;
}

/// Under the lock, on the system's thread.
void closeOrphans(System& it) {
    for (GLFWwindow* orphan : it.orphans) glfwDestroyWindow(orphan);
    it.orphans.clear();
    if (it.is_open && it.windows.empty()) {
        glfwTerminate();
        it.is_open = false;
    }
}

/// What GLFW has to say about its last call.
std::string lastError() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text ? text : "no reason is given";
}

std::string variable(const char* name) {
    const char* value = std::getenv(name);
    return value ? fmt::format("{} is '{}'", name, value) : fmt::format("{} is not set", name);
}

int keyOf(int key) {
    // GLFW names printable keys by their character on a US keyboard, as Window does.
    if (key >= GLFW_KEY_SPACE && key < Window::KeyEscape) return key;
    if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12) return Window::KeyF1 + (key - GLFW_KEY_F1);
    switch (key) {
        case GLFW_KEY_ESCAPE: return Window::KeyEscape;
        case GLFW_KEY_ENTER:
        case GLFW_KEY_KP_ENTER: return Window::KeyEnter;
        case GLFW_KEY_TAB: return Window::KeyTab;
        case GLFW_KEY_BACKSPACE: return Window::KeyBackspace;
        case GLFW_KEY_INSERT: return Window::KeyInsert;
        case GLFW_KEY_DELETE: return Window::KeyDelete;
        case GLFW_KEY_LEFT: return Window::KeyLeft;
        case GLFW_KEY_RIGHT: return Window::KeyRight;
        case GLFW_KEY_UP: return Window::KeyUp;
        case GLFW_KEY_DOWN: return Window::KeyDown;
        case GLFW_KEY_PAGE_UP: return Window::KeyPageUp;
        case GLFW_KEY_PAGE_DOWN: return Window::KeyPageDown;
        case GLFW_KEY_HOME: return Window::KeyHome;
        case GLFW_KEY_END: return Window::KeyEnd;
        case GLFW_KEY_LEFT_SHIFT:
        case GLFW_KEY_RIGHT_SHIFT: return Window::KeyShift;
        case GLFW_KEY_LEFT_CONTROL:
        case GLFW_KEY_RIGHT_CONTROL: return Window::KeyControl;
        case GLFW_KEY_LEFT_ALT:
        case GLFW_KEY_RIGHT_ALT: return Window::KeyAlt;
        case GLFW_KEY_LEFT_SUPER:
        case GLFW_KEY_RIGHT_SUPER: return Window::KeySuper;
        default: return Window::KeyNone;
    }
}

void appendUtf8(std::string& text, uint32_t c) {
    const auto put = [&text](uint32_t byte) { text += static_cast<char>(byte); };
    const auto rest = [&put, c](uint32_t shift) { put(0x80 | (c >> shift & 0x3f)); };
    if (c < 0x80) {
        put(c);
    } else if (c < 0x800) {
        put(0xc0 | c >> 6);
        rest(0);
    } else if (c < 0x10000) {
        put(0xe0 | c >> 12);
        rest(6);
        rest(0);
    } else {
        put(0xf0 | c >> 18);
        rest(12);
        rest(6);
        rest(0);
    }
}

template <class Bits>
void press(Bits& down, Bits& pressed, int index, bool is_down) {
    if (index < 0 || static_cast<size_t>(index) >= down.size()) return;
    down.set(static_cast<size_t>(index), is_down);
    if (is_down) pressed.set(static_cast<size_t>(index));
}

}  // namespace

struct Callbacks {
    static WindowEvents& events(GLFWwindow* handle) {
        return static_cast<SystemWindow*>(glfwGetWindowUserPointer(handle))->events_;
    }

    static void set(GLFWwindow* handle) {
        glfwSetWindowCloseCallback(handle, [](GLFWwindow* window) {
            glfwSetWindowShouldClose(window, GLFW_FALSE);
            events(window).close = true;
        });
        glfwSetKeyCallback(handle, [](GLFWwindow* window, int key, int, int action, int) {
            if (const int code = keyOf(key))
                press(events(window).keys, events(window).pressed_keys, code, action != GLFW_RELEASE);
        });
        glfwSetCharCallback(handle, [](GLFWwindow* window, unsigned int c) { appendUtf8(events(window).text, c); });
        glfwSetMouseButtonCallback(handle, [](GLFWwindow* window, int button, int action, int) {
            press(events(window).buttons, events(window).pressed_buttons, button, action != GLFW_RELEASE);
        });
        glfwSetScrollCallback(handle, [](GLFWwindow* window, double x, double y) {
            events(window).wheel += Vector2f(static_cast<float>(x), static_cast<float>(y));
        });
    }
};

Expected<std::unique_ptr<SystemWindow>> SystemWindow::create(const WindowDesc& desc) {
    System& it = system();
    const std::lock_guard lock(it.mutex);
    const std::thread::id here = std::this_thread::get_id();
    // Without windows nobody uses the system: then it may change hands.
    if (it.is_open && it.thread != here && !it.windows.empty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "window.thread",
                                    "another thread has windows: all of a process belong to one thread"));
    if (!it.is_open && !glfwInit())
        return unexpected(makeError(ErrorCode::Unsupported, "window.no_display",
                                    "there is no display to open a window on: {}, {} ({})", variable("DISPLAY"),
                                    variable("WAYLAND_DISPLAY"), lastError()));
    it.is_open = true;
    it.thread = here;

    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    glfwWindowHint(GLFW_RESIZABLE, desc.resizable);
    glfwWindowHint(GLFW_VISIBLE, !desc.hidden);
    GLFWwindow* const handle = glfwCreateWindow(static_cast<int>(desc.width), static_cast<int>(desc.height),
                                                desc.title.c_str(), nullptr, nullptr);
    if (!handle) {
        const std::string reason = lastError();
        closeOrphans(it);
        return unexpected(makeError(ErrorCode::Unsupported, "window.create", "no window of {}x{} pixels: {}",
                                    desc.width, desc.height, reason));
    }
    std::unique_ptr<SystemWindow> window(new SystemWindow(handle));
    glfwSetWindowUserPointer(handle, window.get());
    Callbacks::set(handle);
    it.windows.push_back(window.get());
    closeOrphans(it);
    return window;
}

SystemWindow::~SystemWindow() {
    System& it = system();
    const std::lock_guard lock(it.mutex);
    std::erase(it.windows, this);
    it.orphans.push_back(handle_);
    if (it.thread == std::this_thread::get_id()) closeOrphans(it);
}

Expected<VkSurfaceKHR> SystemWindow::createSurface(VkInstance instance) const {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    const VkResult result = glfwCreateWindowSurface(instance, handle_, nullptr, &surface);
    if (result == VK_SUCCESS) return surface;
    return unexpected(makeError(ErrorCode::Unsupported, "window.unsupported",
                                "Vulkan cannot draw to this window system: {} (VkResult {})", lastError(),
                                static_cast<int>(result)));
}

bool SystemWindow::isHidden() const {
    return glfwGetWindowAttrib(handle_, GLFW_ICONIFIED) || !glfwGetWindowAttrib(handle_, GLFW_VISIBLE);
}

void SystemWindow::poll(uint64_t nanoseconds) {
    System& it = system();
    bool is_shown = false;
    {
        const std::lock_guard lock(it.mutex);
        closeOrphans(it);
        for (const SystemWindow* window : it.windows) is_shown = is_shown || !window->isHidden();
    }
    if (nanoseconds && !is_shown)
        glfwWaitEventsTimeout(static_cast<double>(nanoseconds) * 1e-9);
    else
        glfwPollEvents();
}

Vector2u SystemWindow::size() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(handle_, &width, &height);
    return {std::max(width, 0), std::max(height, 0)};
}

WindowEvents SystemWindow::takeEvents() {
    double x = 0, y = 0;
    int units_x = 0, units_y = 0;
    glfwGetCursorPos(handle_, &x, &y);
    glfwGetWindowSize(handle_, &units_x, &units_y);
    const Vector2u pixels = size();
    events_.width = pixels.x;
    events_.height = pixels.y;
    events_.mouse = {static_cast<float>(x * pixels.x / std::max(units_x, 1)),
                     static_cast<float>(y * pixels.y / std::max(units_y, 1))};
    events_.hidden = isHidden();
    events_.focused = glfwGetWindowAttrib(handle_, GLFW_FOCUSED) != 0;
    WindowEvents taken = events_;
    events_.close = false;
    events_.pressed_buttons.reset();
    events_.pressed_keys.reset();
    events_.wheel = {0, 0};
    events_.text.clear();
    return taken;
}

void SystemWindow::setTitle(const std::string& title) { glfwSetWindowTitle(handle_, title.c_str()); }

void SystemWindow::setSize(uint32_t width, uint32_t height) {
    glfwSetWindowSize(handle_, static_cast<int>(width), static_cast<int>(height));
}

void SystemWindow::setHidden(bool hidden) {
    if (hidden) {
        glfwHideWindow(handle_);
        return;
    }
    if (glfwGetWindowAttrib(handle_, GLFW_ICONIFIED)) glfwRestoreWindow(handle_);
    glfwShowWindow(handle_);
}

}  // namespace glint::window
