// glint splat render: scenes of splats to pictures, along a path of cameras.

#include "progress.h"
#include "tool.h"

#include <glint/base/format_error.h>
#include <glint/format/cameras.h>
#include <glint/format/image.h>
#include <glint/graphics/picture.h>
#include <glint/graphics/splat_renderer.h>

#include <glm/geometric.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::vector<std::filesystem::path> scenes;
    std::filesystem::path cameras;
    uint32_t orbit = 0;
    std::vector<float> camera;  ///< eye and target
    Vector3f up = {0, 0, 1};
    float elevation = 20.0f;
    float distance = 1.2f;
    float fov = 45.0f;
    std::string size;
    std::string output;
    std::string depth;
    Vector3f background = Vector3f(0.0f);
    std::string storage = "half";
    std::string adapter;
    std::string api;
    SplatRenderer::Options rendering;
};

Error usage(const std::string& text) {
    return Error::inFile(ErrorCode::InvalidArgument, "tool.arguments", text, {}, 0);
}

/// A file's name with a number in it: "%d" or "%04d".
class Pattern {
public:
    static Expected<Pattern> parse(const std::string& flag, const std::string& text, size_t count) {
        Pattern pattern;
        const size_t begin = text.find('%');
        if (begin == std::string::npos) {
            if (count > 1) return unexpected(usage(fmt::format("{}: {} pictures need a name with %04d", flag, count)));
            pattern.head_ = text;
            return pattern;
        }
        size_t end = begin + 1;
        while (end < text.size() && text[end] >= '0' && text[end] <= '9') end++;
        if (end - begin > 3 || end >= text.size() || text[end] != 'd' || text.find('%', end) != std::string::npos)
            return unexpected(usage(fmt::format("{}: '{}' has something else than one %d or %04d", flag, text)));
        std::from_chars(text.data() + begin + 1, text.data() + end, pattern.width_);
        pattern.has_number_ = true;
        pattern.head_ = text.substr(0, begin);
        pattern.tail_ = text.substr(end + 1);
        return pattern;
    }

    std::filesystem::path path(size_t number) const {
        return has_number_ ? fmt::format("{}{:0{}}{}", head_, number, std::max(width_, 1), tail_) : head_;
    }

private:
    std::string head_, tail_;
    bool has_number_ = false;
    int width_ = 1;
};

Expected<Vector2u> parseSize(const std::string& text) {
    Vector2u size(0);
    const char* end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size.x);
    if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
        const auto height = std::from_chars(width.ptr + 1, end, size.y);
        if (height.ec == std::errc() && height.ptr == end && size.x >= 1 && size.y >= 1 && size.x <= 16384 &&
            size.y <= 16384)
            return size;
    }
    return unexpected(usage(fmt::format("--size: '{}' is not WIDTHxHEIGHT with numbers from 1 to 16384", text)));
}

/// Where most splats of all scenes are: the box of what is left without a fiftieth at either end of each axis.
BoundBox mostOf(const std::vector<Splats>& scenes) {
    BoundBox box;
    std::vector<float> values;
    for (int axis = 0; axis < 3; axis++) {
        values.clear();
        for (const Splats& scene : scenes)
            for (const Vector3f& position : scene.positions) values.push_back(position[axis]);
        if (values.empty()) return {};
        const auto at = [&](size_t place) {
            std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
            return values[place];
        };
        box.min[axis] = at(values.size() / 50);
        box.max[axis] = at(values.size() - 1 - values.size() / 50);
    }
    return box;
}

/// `count` cameras on a circle around the axis `up` through the middle of the scenes.
std::vector<Camera> makeOrbit(const Options& options, const std::vector<Splats>& scenes, float aspect) {
    const BoundBox box = mostOf(scenes);
    const Vector3f up = glm::normalize(options.up);
    const Vector3f side = glm::normalize(glm::cross(up, std::abs(up.x) < 0.7f ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0)));
    const Vector3f front = glm::cross(side, up);
    const float distance = options.distance * std::max(glm::length(box.size()), 1e-6f);
    const float height = radians(options.elevation);
    std::vector<Camera> cameras;
    for (uint32_t i = 0; i < options.orbit; i++) {
        const float angle = 2.0f * pi * static_cast<float>(i) / static_cast<float>(options.orbit);
        const Vector3f around = std::cos(angle) * front + std::sin(angle) * side;
        const Vector3f eye = box.center() + distance * (std::cos(height) * around + std::sin(height) * up);
        cameras.push_back(Camera().lookAt(eye, box.center(), up).perspective(options.fov, aspect));
    }
    return cameras;
}

Expected<std::vector<PictureCamera>> makeCameras(const Options& options, const std::vector<Splats>& scenes) {
    if (options.cameras.empty() + options.camera.empty() + (options.orbit == 0) != 2)
        return unexpected(usage("one of --cameras, --orbit and --camera says where to look from"));
    if (!(glm::length(options.up) > 1e-6f) || !isFinite(options.up))
        return unexpected(usage("--up: a direction of some length is needed"));
    Vector2u size(1600, 900);
    if (!options.size.empty()) {
        const Expected<Vector2u> given = parseSize(options.size);
        if (!given) return unexpected(given.error());
        size = *given;
    }
    if (!options.cameras.empty()) {
        Expected<std::vector<PictureCamera>> cameras = loadCameras(options.cameras);
        if (!cameras || options.size.empty()) return cameras;
        // As large as fits into the size given.
        for (PictureCamera& camera : *cameras) {
            const double scale =
                std::min(static_cast<double>(size.x) / camera.width, static_cast<double>(size.y) / camera.height);
            camera.width = std::max(static_cast<uint32_t>(std::lround(camera.width * scale)), 1u);
            camera.height = std::max(static_cast<uint32_t>(std::lround(camera.height * scale)), 1u);
        }
        return cameras;
    }
    const float aspect = static_cast<float>(size.x) / static_cast<float>(size.y);
    std::vector<PictureCamera> cameras;
    for (const Camera& camera : makeOrbit(options, scenes, aspect)) cameras.push_back({camera, size.x, size.y, {}});
    if (!options.camera.empty()) {
        const std::vector<float>& c = options.camera;
        const Camera camera =
            Camera().lookAt({c[0], c[1], c[2]}, {c[3], c[4], c[5]}, options.up).perspective(options.fov, aspect);
        cameras.push_back({camera, size.x, size.y, {}});
    }
    return cameras;
}

/// Puts a background behind premultiplied colors, in the format that the file takes.
Expected<Image> finish(const Image& image, const Vector3f& background, const std::filesystem::path& path) {
    Expected<Image> result = Image::create(FormatRGBAf32, image.width(), image.height());
    if (!result) return result;
    std::vector<Vector4f> texels(image.bytes().size() / sizeof(Vector4f));
    std::memcpy(texels.data(), image.bytes().data(), image.bytes().size());
    for (Vector4f& texel : texels) texel = Vector4f(Vector3f(texel) + (1.0f - texel.w) * background, 1.0f);
    std::memcpy(result->bytes().data(), texels.data(), image.bytes().size());
    return path.extension() == ".png" ? result->convert(FormatRGBAu8n) : std::move(result);
}

class Render {
public:
    explicit Render(const Options& options) : options_(options) {}

    Status run() {
        std::vector<Splats> scenes;
        for (const std::filesystem::path& path : options_.scenes) {
            Expected<Splats> splats = Splats::load(path);
            if (!splats) return splats.error();
            scenes.push_back(std::move(*splats));
        }
        const Expected<std::vector<PictureCamera>> cameras = makeCameras(options_, scenes);
        if (!cameras) return cameras.error();
        const Expected<Pattern> output = Pattern::parse("--output", options_.output, cameras->size());
        if (!output) return output.error();
        std::optional<Expected<Pattern>> depth;
        if (!options_.depth.empty()) {
            depth = Pattern::parse("--depth", options_.depth, cameras->size());
            if (!*depth) return depth->error();
        }
        if (Status status = prepare(scenes); !status) return status;
        scenes.clear();

        Progress progress(cameras->size(), "pictures");
        for (size_t i = 0; i < cameras->size(); i++) {
            if (Status status = checkInterrupt("the pictures so far are there"); !status) return status;
            if (Status status = draw((*cameras)[i]); !status) return status;
            if (Status status = save(output->path(i)); !status) return status;
            if (depth)
                if (Status status = saveDepth((*depth)->path(i)); !status) return status;
            progress.update(++pictures_);
        }
        return {};
    }

    void print() const {
        fmt::print("{} pictures of {} splats; {:.3f} s each to draw, {}\n", pictures_, splats_,
                   draw_seconds_ / static_cast<double>(std::max<uint64_t>(pictures_, 1)), device_.getInfo().name);
    }

private:
    Status prepare(const std::vector<Splats>& scenes) {
        device_ = openDevice({.api = options_.api, .adapter = options_.adapter});
        if (!device_) return device_.error();
        SplatRenderer::Options rendering = options_.rendering;
        rendering.antialiased |=
            std::all_of(scenes.begin(), scenes.end(), [](const Splats& splats) { return splats.is_antialiased; });
        for (const Splats& splats : scenes) {
            const SplatModel model(device_, splats,
                                   options_.storage == "float" ? SplatModel::StorageFloat : SplatModel::StorageHalf);
            if (!model) return model.error();
            splats_ += splats.size();
            instances_.push_back({model});
        }
        return renderer_.create(device_, rendering);
    }

    Status draw(const PictureCamera& camera) {
        if (outputs_.color.getWidth() != camera.width || outputs_.color.getHeight() != camera.height) {
            outputs_.color =
                device_.createTexture2D(FormatRGBAf32, camera.width, camera.height, Texture::FlagSurface, "splats");
            if (!options_.depth.empty())
                outputs_.depth =
                    device_.createTexture2D(FormatRf32, camera.width, camera.height, Texture::FlagSurface, "depth");
        }
        const double begin = now();
        Status drawn;
        // The first may find that the tiles' lists are too short: they grow with the second.
        for (int attempt = 0; attempt < 2; attempt++) {
            Compute compute = device_.createCompute();
            renderer_.draw(compute, camera.camera, instances_, outputs_);
            if (Status submitted = device_.submit(compute); !submitted) return submitted;
            drawn = renderer_.check();
            if (drawn.error().id() != "splats.capacity") break;
        }
        draw_seconds_ += now() - begin;
        return drawn;
    }

    Status save(const std::filesystem::path& path) {
        const Expected<Image> image = readImage(device_, outputs_.color);
        if (!image) return image.error();
        const Expected<Image> finished = finish(*image, options_.background, path);
        return finished ? store(*finished, path) : Status(finished.error());
    }

    Status saveDepth(const std::filesystem::path& path) {
        const Expected<Image> image = readImage(device_, outputs_.depth);
        return image ? store(*image, path) : Status(image.error());
    }

    static Status store(const Image& image, const std::filesystem::path& path) {
        std::error_code error;
        if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
        return image.save(path);  // says what is wrong with the folder, too
    }

    const Options& options_;
    Device device_;
    SplatRenderer renderer_;
    std::vector<SplatRenderer::Instance> instances_;
    SplatRenderer::Outputs outputs_;
    uint64_t splats_ = 0;
    uint64_t pictures_ = 0;
    double draw_seconds_ = 0.0;
};

int run(const Options& options) {
    catchSignals();
    Render render(options);
    if (Status status = render.run(); !status) {
        if (status.error().id() == "tool.arguments") return failUsage("splat render", status.error().message());
        const int code = fail("splat render", status.error());
        return status.error().id() == "tool.interrupted" ? ExitInterrupted : code;
    }
    render.print();
    return 0;
}

}  // namespace

Command splatRenderCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    SplatRenderer::Options& rendering = options->rendering;
    CLI::App* sub = app.add_subcommand("render", "Renders scenes of splats to pictures");
    sub->add_option("SCENE", options->scenes, "Splats (.ply, .splat, .spz); several are one scene")->required();
    sub->add_option("-o,--output", options->output, "Pictures to write (.png, .exr, .hdr); %04d becomes their number")
        ->type_name("FILE")
        ->required();
    sub->add_option("--cameras", options->cameras, "From the cameras of a cameras.json")->type_name("FILE");
    sub->add_option("--orbit", options->orbit, "From N places on a circle around the scene")
        ->type_name("N")
        ->check(CLI::Range(1u, 1'000'000u));
    sub->add_option("--camera", options->camera, "From a point towards another")
        ->type_name("X,Y,Z,X,Y,Z")
        ->delimiter(',')
        ->expected(6);
    addVector(*sub, "--up", options->up, "What is up in the pictures, and the axis of --orbit");
    sub->add_option("--elevation", options->elevation, "Of --orbit over the scene's middle, degrees")
        ->check(CLI::Range(-89.0f, 89.0f))
        ->capture_default_str();
    sub->add_option("--distance", options->distance, "Of --orbit, in diagonals of the scene")
        ->check(CLI::Range(0.01f, 1000.0f))
        ->capture_default_str();
    sub->add_option("--fov", options->fov, "Of --orbit and --camera, from bottom to top, degrees")
        ->check(CLI::Range(1.0f, 170.0f))
        ->capture_default_str();
    sub->add_option("--size", options->size, "Pixels; pictures of --cameras become as large as fits into it")
        ->type_name("WxH");
    addVector(*sub, "--background", options->background, "Color behind the splats: red, green, blue, 0 to 1");
    sub->add_option("--depth", options->depth, "View depths to write (.exr), named like the pictures")
        ->type_name("FILE");
    sub->add_option("--storage", options->storage, "Of rotations and harmonics on the device")
        ->check(CLI::IsMember({"half", "float"}))
        ->capture_default_str();
    sub->add_flag("--antialiased", rendering.antialiased, "Mip-Splatting's filter; without it as the scenes say");
    sub->add_option("--near", rendering.near, "View depth below which splats are left out")->capture_default_str();
    sub->add_option("--degree", rendering.max_degree, "Highest degree of harmonics to use")->capture_default_str();
    addDevice(*sub, options->adapter, options->api);
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
