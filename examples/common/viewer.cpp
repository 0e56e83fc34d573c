#include "common/viewer.h"

#include "common/panel.h"

#include <glint/format/image.h>
#include <glint/graphics/picture.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

using namespace glint;

namespace {

/// A slow device slows the scene down, rather than making it jump.
constexpr double longest_step = 1.0 / 30.0;

constexpr const char* shader = R"(
#if VERTEX_SHADER

void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.0, 1.0); }

#else

layout(binding = 0) uniform texture2D picture;

layout(location = 0) out vec4 out_color;

void main() { out_color = vec4(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb, 1.0); }

#endif
)";

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

Viewer::Viewer(Example& example, Device& device) : example_(example), device_(device), timer_(example, device) {}

Viewer::~Viewer() = default;

Status Viewer::open() {
    const ExampleOptions& options = example_.options();
    if (!options.window) return {};
    window_ = device_.createWindow({.title = example_.name(), .width = options.width, .height = options.height});
    if (window_.error().id() == "window.no_display") {
        std::fprintf(stderr, "%s: rendering without a window: %s\n", example_.name().c_str(),
                     window_.error().message().c_str());
        window_ = Window();
        return {};
    }
    if (!window_) return window_.error();
    // One more picture is drawn before the window goes: the one that is written to files.
    window_.setCloseCallback([this] {
        is_closing_ = true;
        return false;
    });
    panel_ = std::make_unique<Panel>(device_, window_.getColorFormat());
    if (panel_->error()) return panel_->error();
    show_ = device_.createPipeline("show");
    show_.setColorFormat(window_.getColorFormat());
    show_.createShaderGLSL(Shader::TypeVertex, shader, "VERTEX_SHADER=1");
    show_.createShaderGLSL(Shader::TypeFragment, shader, "FRAGMENT_SHADER=1");
    time_ = example_.time(0);
    last_ = second_began_ = seconds();
    return show_.create();
}

bool Viewer::nextPicture() {
    do {
        if (is_closing_ || !window_.update()) return false;
        takeInput();
    } while (!window_.render());
    return true;
}

void Viewer::takeInput() {
    if (!panel_->hasKeyboard()) {
        if (window_.isKeyPressed(Window::KeyEscape)) is_closing_ = true;
        if (window_.isKeyPressed(Window::KeySpace)) is_paused_ = !is_paused_;
        if (window_.isKeyPressed(Window::KeyTab)) is_panel_hidden_ = !is_panel_hidden_;
    }
    const double now = seconds();
    const double step = now - last_;
    last_ = now;
    if (!is_paused_) time_ += std::min(step, longest_step);
    second_frames_++;
    if (now - second_began_ >= 0.5) {
        frames_per_second_ = second_frames_ / (now - second_began_);
        second_began_ = now;
        second_frames_ = 0;
    }
    view_.update(window_, !panel_->hasMouse() || is_panel_hidden_, now);
    panel_->update(window_, example_, {frames_per_second_, is_paused_}, step);
}

Status Viewer::resize(Frame& frame) {
    frame.width = window_ ? window_.getWidth() : example_.width();
    frame.height = window_ ? window_.getHeight() : example_.height();
    frame.is_resized = picture_.getWidth() != frame.width || picture_.getHeight() != frame.height;
    if (!frame.is_resized) return {};
    picture_ = device_.createTexture2D(FormatRGBAu8n, frame.width, frame.height,
                                       Texture::FlagTarget | Texture::FlagSurface, "picture");
    if (!picture_) return picture_.error();
    frame.picture = picture_;
    frame.target = device_.createTarget(picture_);
    return {};
}

Status Viewer::show(bool is_last) {
    Command command = device_.createCommand(window_.getTarget());
    command.setPipeline(show_);
    command.setTexture(0, picture_);
    command.drawArrays(3);
    if (!is_panel_hidden_) panel_->draw(command);
    if (Status status = device_.submit(command); !status) return status;
    if (is_last && !example_.options().screenshot.empty()) {
        const Expected<Image> image = window_.grab();
        if (!image) return image.error();
        if (Status status = example_.saveScreenshot(*image); !status) return status;
    }
    return window_.present();
}

Status Viewer::run(const std::function<Status(Frame&)>& draw) {
    if (Status status = open(); !status) return status;
    for (Fence& fence : fences_) fence = device_.createFence();
    const bool is_endless = window_ && !example_.options().frames_given;
    Frame frame{.view = view_, .timer = timer_};
    for (; is_endless || frame.index < example_.options().frames; frame.index++) {
        if (window_ && !nextPicture()) break;
        if (Status status = resize(frame); !status) return status;
        // As many frames are under way at once as there are fences.
        Fence& fence = fences_[frame.index % fences_.size()];
        if (Status status = fence.wait(); !status) return status;
        if (Status status = timer_.next(); !status) return status;
        frame.time = window_ ? example_.options().time.value_or(time_) : example_.time(frame.index);
        if (Status status = draw(frame); !status) return status;
        if (window_) {
            const bool is_last = is_closing_ || (!is_endless && frame.index + 1 == example_.options().frames);
            if (Status status = show(is_last); !status) return status;
        }
        if (Status status = device_.submit(std::initializer_list<SubmitItem>(), fence); !status) return status;
    }
    if (window_.state() == ObjectState::Failed) return window_.error();
    example_.statistics().frames = frame.index;
    example_.statistics().width = frame.width;
    example_.statistics().height = frame.height;
    return timer_.finish();
}

int Viewer::finish() {
    if (picture_) {
        const Expected<Image> image = readImage(device_, picture_);
        if (!image) return report(image.error());
        if (Status status = example_.saveImage(*image); !status) return report(status.error());
    }
    return example_.finish();
}
