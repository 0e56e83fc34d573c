#pragma once

// What every example shares: arguments, pictures and statistics.
//
//     int main(int argc, char** argv) {
//         Example example("05_tracing", "Ray queries from a compute shader.");
//         std::string mesh_path;
//         example.add("--mesh", mesh_path, "OBJ file to show");
//         if (!example.parse(argc, argv)) return example.exitCode();
//         ...
//         return example.finish();
//     }

#include "common/statistics.h"

#include <glint/base/error.h>
#include <glint/base/status.h>
#include <glint/device/features.h>
#include <glint/format/image.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

/// Arguments that every example takes.
struct ExampleOptions {
    uint32_t width = 1600;  ///< --size WxH, texels: each from 1 to 16384
    uint32_t height = 900;
    uint32_t frames = 1;          ///< --frames N: how many to draw; 1 or more
    bool frames_given = false;    ///< else a window stays until it is closed
    std::optional<double> time;   ///< --time SECONDS: every frame shows this moment; 0 to 500,000
    std::filesystem::path image;  ///< --image FILE: where to write the last frame; empty: nowhere
    std::filesystem::path stats;  ///< --stats FILE.json: where to write the statistics; empty: nowhere
    std::string adapter;          ///< --adapter N|NAME: index or part of a name; empty: the best
    std::string api;              ///< --api NAME; empty: the default
    glint::TracingEngine tracing = glint::TracingEngine::Auto;  ///< --tracing auto|driver|software
    bool window = false;                                        ///< --window
    std::filesystem::path screenshot;  ///< --screenshot FILE: where to write what a window shows last; empty: nowhere
};

/// An argument that may also be changed while the example runs in a window.
struct Knob {
    std::string name;
    std::string help;
    std::variant<bool*, uint32_t*, float*> value;
    float minimum = 0.0f;
    float maximum = 1.0f;
};

class Example {
public:
    /// `name` as the folder has it, such as "05_tracing"; `description`: one line for --help.
    Example(std::string name, const std::string& description);
    ~Example();
    Example(const Example&) = delete;
    Example& operator=(const Example&) = delete;

    /// Further arguments of this example, to be added before parse(); what `value` holds before is the default.
    void add(const std::string& flag, std::string& value, const std::string& help);
    void add(const std::string& flag, std::filesystem::path& value, const std::string& help);
    /// May be given several times, or with several values.
    void add(const std::string& flag, std::vector<std::filesystem::path>& values, const std::string& help);
    void add(const std::string& flag, uint32_t& value, const std::string& help);
    void add(const std::string& flag, float& value, const std::string& help);
    /// An argument without a value: `value` becomes true if it is given.
    void add(const std::string& flag, bool& value, const std::string& help);

    /// The same as knobs of the panel that a window has, from `minimum` to `maximum`; `value` may change with every
    /// frame.
    void addKnob(const std::string& flag, bool& value, const std::string& help);
    void addKnob(const std::string& flag, uint32_t& value, uint32_t minimum, uint32_t maximum, const std::string& help);
    void addKnob(const std::string& flag, float& value, float minimum, float maximum, const std::string& help);
    std::vector<Knob>& knobs() { return knobs_; }

    /// The moment that the first frame shows, unless --time says otherwise; 0 without this call.
    void setStart(double seconds) { start_ = seconds; }

    /// Reads the arguments. False if the program should end now, with exitCode(): 0 after --help, 2 after a wrong
    /// argument, which has been reported on stderr.
    bool parse(int argc, const char* const* argv);
    int exitCode() const { return exit_code_; }

    const std::string& name() const { return name_; }
    const ExampleOptions& options() const { return options_; }
    uint32_t width() const { return options_.width; }
    uint32_t height() const { return options_.height; }
    /// Width / height.
    float aspect() const { return static_cast<float>(options_.width) / static_cast<float>(options_.height); }
    /// The moment that frame `frame` shows, seconds: --time if given, else 1/60 s for each frame, so that a run is the
    /// same on every machine. Windows go by the clock instead.
    double time(uint32_t frame) const { return options_.time.value_or(start_ + frame / 60.0); }

    Statistics& statistics() { return statistics_; }

    /// Writes a picture where --image says, if it does; folders are made.
    glint::Status saveImage(const glint::Image& image) const;
    /// The same for --screenshot.
    glint::Status saveScreenshot(const glint::Image& image) const;
    /// Writes the statistics where --stats says, if it does, and ends the program: the exit code.
    int finish();

private:
    struct Parser;
    std::unique_ptr<Parser> parser_;
    std::string name_;
    ExampleOptions options_;
    Statistics statistics_;
    std::vector<Knob> knobs_;
    double start_ = 0.0;
    int exit_code_ = 0;
};

/// Sets the engine that a text names: "auto", "driver" or "software". Otherwise says what is wrong; empty if nothing
/// is.
std::string parseTracingEngine(const std::string& text, glint::TracingEngine& engine);

/// Prints the error on stderr and returns 1: `return report(status.error());`
int report(const glint::Error& error);
