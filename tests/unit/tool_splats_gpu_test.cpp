// `glint splat`: scenes of splats looked at, converted, made and rendered by the program.

#include "support/splat_files.h"
#include "unit/tool_test.h"

#include <glint/format/image.h>
#include <glint/format/splats.h>
#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <thread>

using namespace glint;
using namespace glint::test;

namespace {

class SplatTool : public Tool {
protected:
    /// Splats of a ball of radius 1/2.
    void makeBall(const std::string& name, const Vector3f& place, const std::string& color, uint32_t count = 1500) {
        Mesh mesh = createSphere(0.5f, 3);
        for (Vector3f& position : mesh.positions) position += place;
        write("ball.obj", objText(mesh));
        expectSuccess(fmt::format("splat from-mesh ball.obj {} --count {} --color {} --sky-rays 8 --up 0,0,1", name,
                                  count, color));
    }

    Vector3f colorAt(const std::string& picture, uint32_t x, uint32_t y) {
        const Expected<Image> image = Image::load(dir / picture);
        EXPECT_THAT(image, IsOk());
        return image ? Vector3f(image->load(x, y)) : Vector3f(-1.0f);
    }
};

}  // namespace

TEST_F(SplatTool, TellsWhatAFileHolds) {
    PlyRows rows = randomPlyRows(100, 2, 1);
    for (size_t i = 0; i < rows.rows.size(); i++) rows.at(i, "opacity") = i < 40 ? -10.0f : 10.0f;
    rows.at(3, "x") = NAN;
    rows.at(4, "f_rest_3") = INFINITY;
    rows.at(5, "opacity") = INFINITY;
    for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) rows.at(6, name) = 0.0f;
    ASSERT_THAT(writeFile(dir / "a.ply", rows.bytes()), IsOk());
    const std::string text = expectSuccess("splat info a.ply").output;
    EXPECT_NE(text.find("splats       98\n  dropped    2 (1 position, 1 harmonics)\n"
                        "  repaired   2 (1 rotation, 1 opacity)\ndegree       2\n"),
              std::string::npos)
        << text;
    const auto json = nlohmann::json::parse(expectSuccess("splat info a.ply --json").output);
    EXPECT_EQ(json.at("splats"), 98);
    EXPECT_EQ(json.at("dropped").at("position"), 1);
    EXPECT_EQ(json.at("repaired").at("opacity"), 1);
    EXPECT_EQ(json.at("opacities"), nlohmann::json::parse("[37, 0, 0, 0, 0, 0, 0, 0, 0, 61]"));
    EXPECT_EQ(json.at("host_bytes"), 98 * 4 * (11 + 27));
    // Position, scale, opacity; rotation in two words; 27 halves, padded.
    EXPECT_EQ(json.at("device_bytes").at("half"), 98 * 4 * (7 + 2 + 14));
    const Splats splats = *Splats::load(dir / "a.ply");
    EXPECT_EQ(json.at("centres").at(0).at(2).get<float>(), splats.bounds().min.z);

    ASSERT_THAT(Splats().save(dir / "none.spz"), IsOk());
    EXPECT_NE(expectSuccess("splat info none.spz").output.find("splats       0\n"), std::string::npos);
    EXPECT_EQ(nlohmann::json::parse(expectSuccess("splat info none.spz --json").output).at("splats"), 0);
    expectFailure("splat", 2, "tool.arguments");
    expectFailure("splat info", 2, "tool.arguments");
    expectFailure("splat info absent.ply", 1, "file.open");
    expectFailure("splat info a.obj", 2, "splats.unknown_extension");
    write("broken.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n");
    expectFailure("splat info broken.ply", 2, "splats.property");
}

TEST_F(SplatTool, ConvertsFiles) {
    const Splats splats = randomSplats(200, 3, 1);
    ASSERT_THAT(splats.save(dir / "a.ply"), IsOk());
    const Splats read = *Splats::load(dir / "a.ply");
    expectSuccess("splat convert a.ply a.spz");
    expectSuccess("splat convert a.spz a.splat");
    EXPECT_EQ(Splats::load(dir / "a.spz")->degree, 3u);
    EXPECT_EQ(Splats::load(dir / "a.splat")->size(), 200u);

    const std::string text = expectSuccess("splat convert a.ply b.ply --degree 1 --min-opacity 0.5").output;
    const Splats less = *Splats::load(dir / "b.ply");
    size_t kept = 0;
    for (size_t i = 0; i < read.size(); i++) {
        if (read.opacities[i] < 0.5f) continue;
        ASSERT_LT(kept, less.size());
        EXPECT_EQ(less.positions[kept], read.positions[i]);
        for (size_t k = 0; k < 4; k++) EXPECT_EQ(less.harmonics[4 * kept + k], read.harmonics[16 * i + k]);
        kept++;
    }
    EXPECT_EQ(less.size(), kept);
    EXPECT_EQ(less.degree, 1u);
    EXPECT_TRUE(text.starts_with(fmt::format("{} of 200 splats written, of degree 1;", kept))) << text;

    EXPECT_FALSE(Splats::load(dir / "a.spz")->is_antialiased);
    expectSuccess("splat convert a.ply marked.spz --antialiased");
    EXPECT_TRUE(Splats::load(dir / "marked.spz")->is_antialiased);
    expectSuccess("splat convert marked.spz again.spz");
    EXPECT_TRUE(Splats::load(dir / "again.spz")->is_antialiased);

    const std::vector<std::string> before = files();
    expectFailure("splat convert a.ply a.obj", 2, "splats.unknown_extension");
    expectFailure("splat convert a.ply absent/a.spz", 1, "file.create");
    expectFailure("splat convert a.ply", 2, "tool.arguments");
    expectFailure("splat convert a.ply c.ply --degree 4", 2, "tool.arguments");
    expectFailure("splat convert a.ply c.ply --min-opacity 1.5", 2, "tool.arguments");
    Splats far = splats;
    far.positions[7].x = 1e7f;
    ASSERT_THAT(far.save(dir / "a.ply"), IsOk());
    expectFailure("splat convert a.ply c.spz", 2, "splats.range");
    EXPECT_EQ(files(), before);
}

TEST_F(SplatTool, MakesSplatsOfAMesh) {
    makeBall("a.ply", Vector3f(0.0f), "0.8,0.1,0.1");
    const Expected<Splats> splats = Splats::load(dir / "a.ply");
    ASSERT_THAT(splats, IsOk());
    EXPECT_EQ(splats->size(), 1500u);
    EXPECT_EQ(splats->degree, 3u);
    for (const Vector3f& position : splats->positions) EXPECT_NEAR(glm::length(position), 0.5f, 0.02f);
    // Another run, and rays that are answered by another engine or in other pieces, give the same.
    makeBall("b.ply", Vector3f(0.0f), "0.8,0.1,0.1");
    EXPECT_EQ(*readTextFile(dir / "a.ply"), *readTextFile(dir / "b.ply"));
    expectSuccess("splat from-mesh ball.obj c.spz --count 200 --degree 1");
    const Expected<Splats> packed = Splats::load(dir / "c.spz");
    ASSERT_THAT(packed, IsOk());
    EXPECT_EQ(packed->size(), 200u);
    EXPECT_EQ(packed->degree, 1u);
}

TEST_F(SplatTool, RendersAPathOfCameras) {
    makeBall("ball.ply", Vector3f(0.0f), "0.8,0.1,0.1");
    expectSuccess("splat render ball.ply --orbit 3 --size 64x48 --background 0.2,0.4,0.6 -o out/p_%02d.png "
                  "--depth out/d_%02d.exr --elevation 30 --distance 2");
    for (const char* number : {"00", "01", "02"}) {
        const std::string picture = fmt::format("out/p_{}.png", number);
        EXPECT_LT(glm::distance(colorAt(picture, 0, 0), Vector3f(0.2f, 0.4f, 0.6f)), 0.01f);
        const Vector3f middle = colorAt(picture, 32, 24);
        EXPECT_GT(middle.x, 1.5f * middle.y) << number;
        const Expected<Image> depth = Image::load(dir / fmt::format("out/d_{}.exr", number));
        ASSERT_THAT(depth, IsOk());
        EXPECT_EQ(depth->width(), 64u);
        EXPECT_TRUE(std::isinf(depth->load(0, 0).x));
        // Twice the diagonal of the box of what most splats are in, a cube with sides of about 1, less the radius.
        EXPECT_NEAR(depth->load(32, 24).x, 2.0f * std::sqrt(3.0f) * 0.96f - 0.5f, 0.15f);
    }
    EXPECT_FALSE(std::filesystem::exists(dir / "out/p_03.png"));
}

// The same camera in both ways to say it. cameras.json has columns x right, y down, z forward: an eye at -4 on the Y
// axis that looks along +Y, with Z up.
TEST_F(SplatTool, RendersFromCamerasOfAFile) {
    makeBall("ball.ply", Vector3f(0.1f, 0.0f, 0.05f), "0.1,0.7,0.2");
    // A focal length of h / (2 tan 20 degrees).
    write("cameras.json", R"([{"id": 0, "img_name": "front", "width": 128, "height": 96, "position": [0, -4, 0],
        "rotation": [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "fx": 131.87889, "fy": 131.87889}])");
    expectSuccess("splat render ball.ply --cameras cameras.json --size 64x64 -o a.exr --storage float");
    expectSuccess("splat render ball.ply --camera 0,-4,0,0,0,0 --fov 40 --size 64x48 -o b.exr --storage float");
    expectSuccess("splat render ball.ply --camera 0,-4,0,0,0,0 --fov 40 --size 64x48 -o c.exr");
    const Expected<Image> a = Image::load(dir / "a.exr"), b = Image::load(dir / "b.exr"),
                          c = Image::load(dir / "c.exr");
    ASSERT_THAT(a, IsOk());
    ASSERT_THAT(b, IsOk());
    ASSERT_THAT(c, IsOk());
    ASSERT_EQ(a->width(), 64u);
    ASSERT_EQ(a->height(), 48u);
    float from_file = 0.0f, from_half = 0.0f, brightest = 0.0f;
    for (uint32_t y = 0; y < 48; y++) {
        for (uint32_t x = 0; x < 64; x++) {
            from_file = std::max(from_file, glm::length(a->load(x, y) - b->load(x, y)));
            from_half = std::max(from_half, glm::length(b->load(x, y) - c->load(x, y)));
            brightest = std::max(brightest, b->load(x, y).y);
        }
    }
    EXPECT_GT(brightest, 0.5f);
    // A focal length rounded to 8 digits moves an outline by 1e-6 pixels, of alphas that rise to 1 within one or two.
    EXPECT_LT(from_file, 1e-4f);
    // Harmonics of up to 2, rounded to 2^-11 of themselves, 16 of them; turns of 2^-15 are less.
    EXPECT_GT(from_half, 0.0f);
    EXPECT_LT(from_half, 16 * 2 * 0x1p-11f);
}

// Red on the left, green on the right, and where they overlap the nearer one, whichever is named first.
TEST_F(SplatTool, RendersSeveralModelsAsOneScene) {
    makeBall("red.ply", Vector3f(-0.3f, 0.0f, 0.0f), "0.8,0.05,0.05");
    makeBall("green.spz", Vector3f(0.3f, -0.6f, 0.0f), "0.05,0.7,0.05");
    for (const char* scenes : {"red.ply green.spz", "green.spz red.ply"}) {
        const Outcome outcome = expectSuccess(
            fmt::format("splat render {} --camera 0,-4,0,0,0,0 --fov 40 --size 64x48 -o out.png", scenes));
        EXPECT_NE(outcome.output.find("3000 splats"), std::string::npos) << outcome.output;
        const Vector3f left = colorAt("out.png", 22, 24), right = colorAt("out.png", 42, 24),
                       middle = colorAt("out.png", 32, 24);
        EXPECT_GT(left.x, 1.5f * left.y);
        EXPECT_GT(right.y, 1.5f * right.x);
        EXPECT_GT(middle.y, 1.5f * middle.x);
    }
}

TEST_F(SplatTool, SaysWhatIsWrong) {
    makeBall("ball.ply", Vector3f(0.0f), "0.5,0.5,0.5", 100);
    write("bad.json", "[{\"position\": 1}]");
    write("bad.ply", "ply\n");
    const std::vector<std::string> before = files();
    const auto refuse = [&](const std::string& arguments, int status, const std::string& id) {
        expectFailure("splat " + arguments, status, id);
    };
    refuse("render ball.ply -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 2 --camera 0,0,0,1,1,1 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 2 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 2 -o a_%s.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 2 -o a_%d_%d.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 2 -o a_%d.png --depth b.exr", 2, "tool.arguments");
    refuse("render ball.ply --orbit 0 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 1 --up 0,0,0 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 1 --size 0x4 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 1 --size 64 -o a.png", 2, "tool.arguments");
    refuse("render ball.ply --orbit 1 --storage byte -o a.png", 2, "tool.arguments");
    refuse("render absent.ply --orbit 1 -o a.png", 1, "file.open");
    refuse("render ball.obj --orbit 1 -o a.png", 2, "splats.unknown_extension");
    refuse("render ball.ply --cameras absent.json -o a.png", 1, "file.open");
    refuse("render ball.ply --cameras bad.json -o a.png", 2, "cameras.key");
    refuse("render ball.ply --orbit 1 --size 8x8 --near -1 -o a.png", 2, "splats.options");
    refuse("render ball.ply --orbit 1 --size 8x8 -o a.gif", 2, "image.unknown_extension");
    refuse("render ball.ply --orbit 1 --size 8x8 -o ball.ply/a.png", 1, "file.create");
    refuse("render ball.ply --orbit 1 --adapter nonesuch -o a.png", 1, "device.no_adapter");
    refuse("from-mesh ball.obj a.txt", 2, "tool.arguments");
    refuse("from-mesh ball.obj a.ply --count 0", 2, "surface.count");
    refuse("from-mesh ball.obj a.ply --count 10 --color 2,0,0", 2, "splats.from_mesh");
    refuse("from-mesh ball.obj a.ply --color 1,0", 2, "tool.arguments");
    refuse("from-mesh ball.obj a.ply --lamp 0,0,0", 2, "splats.from_mesh");
    refuse("from-mesh absent.obj a.ply", 1, "file.open");
    refuse("from-mesh ball.obj absent/a.ply --count 10", 1, "file.create");
    EXPECT_EQ(files(), before);
}

TEST_F(SplatTool, RenderingCanBeInterrupted) {
    makeBall("ball.ply", Vector3f(0.0f), "0.5,0.5,0.5", 100);
    const pid_t child = ::fork();
    if (child == 0) {
        if (::chdir(dir.path().c_str()) != 0 || !std::freopen("/dev/null", "w", stderr)) ::_exit(9);
        ::execl(GLINT_TOOL, "glint", "splat", "render", "ball.ply", "--orbit", "1000000", "--size", "16x16", "-o",
                "p_%d.png", nullptr);
        ::_exit(9);
    }
    ASSERT_GT(child, 0);
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!std::filesystem::exists(dir / "p_2.png") && std::chrono::steady_clock::now() < limit)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ::kill(child, SIGINT);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 130);
    // What is there is whole.
    size_t pictures = 0;
    for (const std::string& name : files()) {
        if (!name.starts_with("p_")) continue;
        EXPECT_THAT(Image::load(dir / name), IsOk());
        pictures++;
    }
    EXPECT_GE(pictures, 3u);
}
