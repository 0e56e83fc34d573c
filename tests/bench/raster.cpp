// raster.{10k,100k,1m}.compute_over_driver: triangles of about one pixel through Rasterizer against the driver's own
// pipeline, both to depth and the number of the triangle, 1600 x 900, in turns in one run. raster.area.N.* the same for
// 10,000 triangles of N pixels each. A table has all sizes with all numbers.

#include "bench/tracing_batch.h"

#include "support/reference.h"

#include <glint/graphics/rasterizer.h>
#include <glint/math/camera.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace glint::bench {

namespace {

constexpr uint32_t width = 1600, height = 900;
constexpr uint32_t rounds = 9;
/// A table's cell takes no longer than so many pixels do.
constexpr double most_pixels = 8e7;

constexpr const char* vertex_source = R"(
layout(push_constant) uniform Parameters { mat4 clip_from_mesh; };
layout(location = 0) in vec3 position;
void main() { gl_Position = clip_from_mesh * vec4(position, 1.0); }
)";

constexpr const char* fragment_source = R"(
layout(location = 0) out uint id;
void main() { id = uint(gl_PrimitiveID) + 1u; }
)";

struct Triangles {
    std::vector<Vector3f> positions;
    std::vector<uint32_t> indices;
    uint32_t count() const { return static_cast<uint32_t>(indices.size() / 3); }
};

Camera makeCamera() { return Camera().perspective(60.0f, float(width) / height); }

/// Sheets of triangles that cover about `area` pixels each, as far apart as random depths are: as many sheets as it
/// takes, each within the picture, in front of or behind each other. Rows of a sheet follow each other, as in meshes
/// that are ordered for caches; neighbours share vertices.
Triangles makeTriangles(uint32_t count, double area) {
    const CameraParameters camera = makeCamera().parameters();
    const double cell = std::sqrt(2.0 * area);
    const auto columns = static_cast<uint32_t>(std::min(std::floor(0.98 * width / cell), std::sqrt(count / 2.0)));
    const auto most_rows = static_cast<uint32_t>(0.98 * height / cell);
    test::Random random(count + static_cast<uint64_t>(area * 16.0));
    Triangles result;
    result.indices.reserve(size_t{count} * 3);
    while (result.count() < count) {
        const uint32_t left = count - result.count();
        const uint32_t rows = std::min(most_rows, (left + 2 * columns - 1) / (2 * columns));
        const double depth = random.uniform(5.0, 50.0);
        const Vector2d corner = 0.5 * (Vector2d(width, height) - cell * Vector2d(columns, rows));
        const auto first = static_cast<uint32_t>(result.positions.size());
        for (uint32_t j = 0; j <= rows; j++)
            for (uint32_t i = 0; i <= columns; i++) {
                // Off the grid, so that no edge is along an axis; never so far that a triangle turns over.
                const Vector2d jitter(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2));
                const Vector2d place = corner + cell * (Vector2d(i, j) + jitter);
                const double z = depth * random.uniform(0.999, 1.001);
                const Vector3d direction = Vector3d(Vector4d(camera.ray_corner)) +
                                           Vector3d(Vector4d(camera.ray_x)) * (place.x / width) +
                                           Vector3d(Vector4d(camera.ray_y)) * (place.y / height);
                result.positions.emplace_back(Vector3d(Vector4d(camera.position)) + direction * z);
            }
        for (uint32_t j = 0; j < rows; j++)
            for (uint32_t i = 0; i < columns && result.count() < count; i++) {
                const uint32_t a = first + j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
                result.indices.insert(result.indices.end(), {a, c, b});
                if (result.count() < count) result.indices.insert(result.indices.end(), {b, c, d});
            }
    }
    return result;
}

/// The triangles on a device, and both ways of drawing them.
class Sides {
public:
    Sides(const Device& device, const Triangles& triangles)
        : device_(device),
          count_(triangles.count()),
          positions_(device_.createBuffer(Buffer::FlagVertex | Buffer::FlagStorage, std::span(triangles.positions))),
          indices_(device_.createBuffer(Buffer::FlagIndex | Buffer::FlagStorage, std::span(triangles.indices))),
          pipeline_(device_.createPipeline("driver")),
          ids_(device_.createTexture2D(FormatRu32, width, height, Texture::FlagTarget)),
          depth_(device_.createTexture2D(FormatDf32, width, height, Texture::FlagTarget)),
          target_(device_.createTarget(ids_, depth_)) {
        pipeline_.createShaderGLSL(Shader::TypeVertex, vertex_source);
        pipeline_.createShaderGLSL(Shader::TypeFragment, fragment_source);
        pipeline_.addAttribute(Pipeline::AttributePosition, FormatRGBf32, 0, 0, sizeof(Vector3f));
        pipeline_.setColorFormat(FormatRu32);
        pipeline_.setDepthFormat(FormatDf32);
        pipeline_.setDepthFunc(Pipeline::DepthFuncGreater);
        pipeline_.setCullMode(Pipeline::CullModeBack);
        check(pipeline_.create());
        target_.setClearColor(Color(0.0f, 0.0f, 0.0f, 0.0f));
        target_.setClearDepth(0.0f);
        check(rasterizer_.create(device_));
        const CameraParameters camera = makeCamera().parameters();
        clip_from_mesh_ = camera.projection * camera.view;
    }

    void driver() {
        Command command = device_.createCommand(target_);
        command.setPipeline(pipeline_);
        command.setPushConstants(clip_from_mesh_);
        command.setVertexBuffer(0, positions_);
        command.setIndexBuffer(FormatRu32, indices_);
        command.drawElements(3 * count_);
        check(device_.submit(command));
        check(device_.finish());
    }

    void compute() {
        Compute compute = device_.createCompute();
        rasterizer_.begin(compute, {width, height});
        rasterizer_.draw(compute, {.positions = positions_, .indices = indices_, .triangles = count_}, clip_from_mesh_,
                         0, Rasterizer::CullBack);
        check(device_.submit(compute));
        check(device_.finish());
    }

    /// Draws until all lists are long enough.
    void prepare() {
        for (int attempt = 0; attempt < 8; attempt++) {
            compute();
            if (rasterizer_.check()) return;
        }
        check(rasterizer_.check());
    }

    /// Pixels at which the two sides show different triangles, and those that show one.
    std::pair<uint64_t, uint64_t> compare() {
        std::vector<uint32_t> theirs(size_t{width} * height);
        check(device_.getTexture(ids_, theirs.data(), theirs.size() * sizeof(uint32_t)));
        const auto ours = *check(device_.read<uint64_t>(rasterizer_.getVisibility(), 0, theirs.size()));
        uint64_t differing = 0, covered = 0;
        for (size_t i = 0; i < ours.size(); i++) {
            // As the fragment shader writes it: 0 is nothing.
            const uint32_t triangle = ours[i] == Rasterizer::background ? 0 : ~static_cast<uint32_t>(ours[i]) + 1;
            differing += triangle != theirs[i];
            covered += triangle != 0;
        }
        return {differing, covered};
    }

private:
    Device device_;
    uint32_t count_;
    Matrix4x4f clip_from_mesh_ = Matrix4x4f(1.0f);
    Buffer positions_, indices_;
    Pipeline pipeline_;
    Texture ids_, depth_;
    Target target_;
    Rasterizer rasterizer_;
};

/// Speed of compute over the driver's, prints a line.
double race(const Device& device, uint32_t count, double area) {
    Sides sides(device, makeTriangles(count, area));
    sides.prepare();
    RaceTimes driver, compute;
    for (uint32_t turn = 0; turn <= rounds; turn++) {
        // The driver compiles at the first draw, which does not count.
        driver.take([&] { sides.driver(); }, turn > 0);
        compute.take([&] { sides.compute(); }, turn > 0);
    }
    const auto [differing, covered] = sides.compare();
    // The fastest turn is the one that other programs have disturbed least.
    const double ratio = driver.wall.minimum() / compute.wall.minimum();
    fmt::print("{:>10} {:>8} {:>10.2f} {:>10.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>10} {:>10}\n", count, area,
               driver.wall.minimum() * 1e3, compute.wall.minimum() * 1e3, ratio,
               driver.wall.median() / compute.wall.median(), driver.process.median() / compute.process.median(),
               covered, differing);
    std::fflush(stdout);
    // Both round to 2^-8 pixel and break ties of edges alike: what differs are depths that are equal but for rounding.
    if (static_cast<double>(differing) > 1e-3 * static_cast<double>(covered))
        throw std::runtime_error("the sides drew different pictures");
    return ratio;
}

void run(Report& report) {
    const Device device = createDevice();
    fmt::print("{} x {} pixels; milliseconds, fastest of {} turns; ratios of these, of medians, of processor times\n"
               "{:>10} {:>8} {:>10} {:>10} {:>8} {:>8} {:>8} {:>10} {:>10}\n",
               width, height, rounds, "triangles", "pixels", "driver", "compute", "ratio", "medians", "process",
               "covered", "differing");
    for (const auto& [count, name] : {std::pair(10000u, "10k"), std::pair(100000u, "100k"), std::pair(1000000u, "1m")})
        for (const double area : {0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0}) {
            if (count * area > most_pixels) continue;
            const double ratio = race(device, count, area);
            if (area == 1.0)
                report.add(fmt::format("raster.{}.compute_over_driver", name), ratio, "ratio of speeds",
                           "the driver's pipeline", deviceName(device));
            else if (count == 10000)
                report.add(fmt::format("raster.area.{}.compute_over_driver", area), ratio, "ratio of speeds",
                           "the driver's pipeline", deviceName(device));
        }
}

}  // namespace

Benchmark rasterBenchmark() {
    std::vector<std::string> figures;
    for (const char* name :
         {"10k", "100k", "1m", "area.0.25", "area.4", "area.16", "area.64", "area.256", "area.1024", "area.4096"})
        figures.push_back(fmt::format("raster.{}.compute_over_driver", name));
    return {figures, run};
}

}  // namespace glint::bench
