#pragma once

// The frame loop of every example: without a window N pictures one after the other, with one as many as the user wants
// to see. The example draws the same way in both.
//
//     Viewer viewer(example, device);
//     const Status status = viewer.run([&](Frame& frame) {
//         Command command = device.createCommand(frame.target);
//         frame.timer.begin(command, "scene");
//         ...
//         frame.timer.end(command);
//         return device.submit(command);
//     });
//     if (!status) return report(status.error());
//     return viewer.finish();

#include "common/device.h"
#include "common/orbit.h"

#include <array>
#include <functional>
#include <memory>

class Panel;

/// One picture to be drawn.
struct Frame {
    uint32_t index = 0;
    double time = 0.0;   ///< of the scene, seconds
    uint32_t width = 0;  ///< of the picture, pixels
    uint32_t height = 0;
    bool is_resized = false;  ///< in the first frame, and whenever the size is another one
    glint::Texture picture;   ///< FormatRGBAu8n, a target and a surface
    glint::Target target;     ///< draws into the picture; what is set on it stays until the size changes
    const OrbitView& view;
    PassTimer& timer;

    float aspect() const { return static_cast<float>(width) / static_cast<float>(height); }
};

class Viewer {
public:
    Viewer(Example& example, glint::Device& device);
    ~Viewer();
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    /// Calls `draw`, which submits, for each frame. With --window it opens a window first; where there is no display to
    /// open it on it says so and goes on without. Returns the first error.
    glint::Status run(const std::function<glint::Status(Frame&)>& draw);
    /// Writes the last picture where --image says, the statistics where --stats says, and ends the program: the exit
    /// code.
    int finish();

private:
    glint::Status open();
    /// Waits for the window's next picture. False if the window is closed.
    bool nextPicture();
    void takeInput();
    /// The picture and the panel.
    glint::Status show(bool is_last);
    glint::Status resize(Frame& frame);

    Example& example_;
    glint::Device& device_;
    PassTimer timer_;
    OrbitView view_;
    glint::Window window_;
    std::unique_ptr<Panel> panel_;
    glint::Pipeline show_;
    glint::Texture picture_;
    std::array<glint::Fence, PassTimer::frames> fences_;
    bool is_closing_ = false;
    bool is_paused_ = false;
    bool is_panel_hidden_ = false;
    double time_ = 0.0;  ///< of the scene, in a window without --time
    double last_ = 0.0;  ///< seconds of the clock, at the last frame
    double second_began_ = 0.0;
    uint32_t second_frames_ = 0;
    double frames_per_second_ = 0.0;
};
