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
#include <glint/format/image.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

/// Arguments that every example takes.
struct ExampleOptions {
    uint32_t width = 1600;  ///< --size WxH, texels: each from 1 to 16384
    uint32_t height = 900;
    uint32_t frames = 1;           ///< --frames N: how many to draw; 1 or more
    std::optional<double> time;    ///< --time SECONDS: every frame shows this moment; not negative
    std::filesystem::path image;   ///< --image FILE: where to write the last frame; empty: nowhere
    std::filesystem::path stats;   ///< --stats FILE.json: where to write the statistics; empty: nowhere
    std::string adapter;           ///< --adapter N|NAME: index or part of a name; empty: the best
    std::string api;               ///< --api NAME; empty: the default
    std::string tracing = "auto";  ///< --tracing auto|driver|software
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
    void add(const std::string& flag, uint32_t& value, const std::string& help);
    void add(const std::string& flag, float& value, const std::string& help);
    /// An argument without a value: `value` becomes true if it is given.
    void add(const std::string& flag, bool& value, const std::string& help);

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
    /// same on every machine.
    double time(uint32_t frame) const { return options_.time.value_or(frame / 60.0); }

    Statistics& statistics() { return statistics_; }

    /// Writes a picture where --image says, if it does; folders are made.
    glint::Status saveImage(const glint::Image& image) const;
    /// Writes the statistics where --stats says, if it does, and ends the program: the exit code.
    int finish();

private:
    struct Parser;
    std::unique_ptr<Parser> parser_;
    std::string name_;
    ExampleOptions options_;
    Statistics statistics_;
    int exit_code_ = 0;
};

/// Prints the error on stderr and returns 1: `return report(status.error());`
int report(const glint::Error& error);
