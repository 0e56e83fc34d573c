#include "common/example.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>

namespace {

/// Seconds. Scenes are evaluated in float32, where moments beyond are more than 1/30 s apart.
constexpr uint32_t longest_time = 500'000;

/// "1600x900" to two numbers; the reason why not if it cannot.
std::string parseSize(const std::string& text, uint32_t& width, uint32_t& height) {
    constexpr uint32_t limit = 16384;
    const char* end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, width);
    if (first.ec == std::errc() && first.ptr != end && *first.ptr == 'x') {
        const auto second = std::from_chars(first.ptr + 1, end, height);
        const bool is_whole = second.ec == std::errc() && second.ptr == end;
        if (is_whole && width >= 1 && width <= limit && height >= 1 && height <= limit) return {};
    }
    return "'" + text + "' is not WIDTHxHEIGHT, each from 1 to " + std::to_string(limit) + ", such as 1600x900";
}

glint::Status makeFolder(const std::filesystem::path& file) {
    std::error_code failure;
    if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failure);
    if (!failure) return {};
    return glint::Error::inFile(glint::ErrorCode::Io, "example.folder",
                                "cannot make the folder of '" + file.string() + "': " + failure.message(), {}, 0);
}

}  // namespace

struct Example::Parser {
    CLI::App app;
    std::string size, tracing;
    double time = 0.0;
    CLI::Option* time_option = nullptr;
    CLI::Option* frames_option = nullptr;
};

Example::Example(std::string name, const std::string& description)
    : parser_(std::make_unique<Parser>()), name_(std::move(name)) {
    CLI::App& app = parser_->app;
    app.name(name_);
    app.description(description);
    app.set_help_flag("--help", "Print this and end");
    app.add_option("--size", parser_->size, "Size of the picture in texels")
        ->type_name("WxH")
        ->default_str("1600x900")
        ->check([this](const std::string& text) { return parseSize(text, options_.width, options_.height); });
    parser_->frames_option = app.add_option("--frames", options_.frames, "Number of frames to draw");
    parser_->frames_option->type_name("N")->capture_default_str()->check(CLI::Range(1u, 1000000000u));
    parser_->time_option =
        app.add_option("--time", parser_->time, "Freeze the scene at this moment, in seconds")->type_name("SECONDS");
    parser_->time_option->check([](const std::string& text) {
        double value = 0.0;
        // Written so that NaN fails.
        if (CLI::detail::lexical_cast(text, value) && value >= 0.0 && value <= longest_time) return std::string();
        return fmt::format("'{}' is no number of seconds from 0 to {}", text, longest_time);
    });
    app.add_option("--image", options_.image, "Write the last frame to this file (.png)")->type_name("FILE");
    app.add_option("--stats", options_.stats, "Write times and counts to this file")->type_name("FILE.json");
    app.add_option("--adapter", options_.adapter, "Adapter: its index or a part of its name")->type_name("N|NAME");
    app.add_option("--api", options_.api, "Graphics API")->type_name("NAME");
    app.add_option("--tracing", parser_->tracing, "Engine for ray tracing")
        ->type_name("auto|driver|software")
        ->default_str("auto")
        ->check([this](const std::string& text) { return parseTracingEngine(text, options_.tracing); });
    app.add_flag("--window", options_.window,
                 "Show the frames in a window, until it is closed or --frames are drawn; without a display as without "
                 "this argument");
    app.add_option("--screenshot", options_.screenshot, "Write what the window shows last to this file (.png)")
        ->type_name("FILE");
}

Example::~Example() = default;

void Example::add(const std::string& flag, std::string& value, const std::string& help) {
    parser_->app.add_option(flag, value, help)->type_name("TEXT")->capture_default_str();
}

void Example::add(const std::string& flag, std::filesystem::path& value, const std::string& help) {
    parser_->app.add_option(flag, value, help)->type_name("FILE");
}

void Example::add(const std::string& flag, std::vector<std::filesystem::path>& values, const std::string& help) {
    parser_->app.add_option(flag, values, help)
        ->type_name("FILE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}
void Example::add(const std::string& flag, uint32_t& value, const std::string& help) {
    parser_->app.add_option(flag, value, help)->type_name("N")->capture_default_str();
}

void Example::add(const std::string& flag, float& value, const std::string& help) {
    parser_->app.add_option(flag, value, help)->type_name("NUMBER")->capture_default_str();
}

void Example::add(const std::string& flag, bool& value, const std::string& help) {
    parser_->app.add_flag(flag, value, help);
}

namespace {

/// "--scale" is the knob "scale".
std::string knobName(const std::string& flag) {
    return flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
}

}  // namespace

void Example::addKnob(const std::string& flag, bool& value, const std::string& help) {
    add(flag, value, help);
    knobs_.push_back({knobName(flag), help, &value});
}

void Example::addKnob(const std::string& flag, uint32_t& value, uint32_t minimum, uint32_t maximum,
                      const std::string& help) {
    parser_->app.add_option(flag, value, help)
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(minimum, maximum));
    knobs_.push_back({knobName(flag), help, &value, static_cast<float>(minimum), static_cast<float>(maximum)});
}

void Example::addKnob(const std::string& flag, float& value, float minimum, float maximum, const std::string& help) {
    const auto check = [minimum, maximum](const std::string& text) {
        float number = 0.0f;
        // Written so that NaN fails.
        if (CLI::detail::lexical_cast(text, number) && number >= minimum && number <= maximum) return std::string();
        return fmt::format("'{}' is no number from {} to {}", text, minimum, maximum);
    };
    parser_->app.add_option(flag, value, help)->type_name("NUMBER")->capture_default_str()->check(check);
    knobs_.push_back({knobName(flag), help, &value, minimum, maximum});
}

bool Example::parse(int argc, const char* const* argv) {
    try {
        parser_->app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        std::fputs(parser_->app.help().c_str(), stdout);
        exit_code_ = 0;
        return false;
    } catch (const CLI::ParseError& error) {
        std::fprintf(stderr, "%s: %s (--help lists the arguments)\n", name_.c_str(), error.what());
        exit_code_ = 2;
        return false;
    }
    if (parser_->time_option->count()) options_.time = parser_->time;
    options_.frames_given = parser_->frames_option->count() > 0;
    statistics_.example = name_;
    statistics_.width = options_.width;
    statistics_.height = options_.height;
    statistics_.frames = options_.frames;
    return true;
}

namespace {

glint::Status saveTo(const std::filesystem::path& file, const glint::Image& image) {
    if (file.empty()) return {};
    if (glint::Status status = makeFolder(file); !status) return status;
    return image.save(file);
}

}  // namespace

glint::Status Example::saveImage(const glint::Image& image) const { return saveTo(options_.image, image); }

glint::Status Example::saveScreenshot(const glint::Image& image) const { return saveTo(options_.screenshot, image); }

int Example::finish() {
    if (options_.stats.empty()) return 0;
    if (glint::Status status = makeFolder(options_.stats); !status) return report(status.error());
    if (glint::Status status = statistics_.write(options_.stats); !status) return report(status.error());
    return 0;
}

std::string parseTracingEngine(const std::string& text, glint::TracingEngine& engine) {
    using glint::TracingEngine;
    for (const TracingEngine known : {TracingEngine::Auto, TracingEngine::Driver, TracingEngine::Software}) {
        if (text != toString(known)) continue;
        engine = known;
        return {};
    }
    return "'" + text + "' is none of auto, driver, software";
}

int report(const glint::Error& error) {
    std::fprintf(stderr, "%s\n", error.text().c_str());
    return 1;
}
