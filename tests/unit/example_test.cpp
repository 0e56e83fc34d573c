#include "common/example.h"
#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>

#include <nlohmann/json.hpp>

#include <gtest/gtest.h>

using namespace glint;
using namespace glint::test;

namespace {

struct Outcome {
    bool parsed = false;
    std::string output;
    std::string errors;
};

Outcome parse(Example& example, std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "program");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Outcome run;
    run.parsed = example.parse(static_cast<int>(arguments.size()), arguments.data());
    run.output = testing::internal::GetCapturedStdout();
    run.errors = testing::internal::GetCapturedStderr();
    return run;
}

}  // namespace

TEST(Example, Defaults) {
    Example example("05_tracing", "Rays.");
    EXPECT_TRUE(parse(example, {}).parsed);
    EXPECT_EQ(example.exitCode(), 0);
    EXPECT_EQ(example.width(), 1600u);
    EXPECT_EQ(example.height(), 900u);
    EXPECT_EQ(example.options().frames, 1u);
    EXPECT_FALSE(example.options().time);
    EXPECT_EQ(example.options().tracing, TracingEngine::Auto);
    EXPECT_DOUBLE_EQ(example.time(30), 0.5);
}

TEST(Example, EveryArgument) {
    Example example("05_tracing", "Rays.");
    std::filesystem::path mesh;
    uint32_t count = 3;
    float scale = 1.5f;
    bool quick = false;
    std::string kind = "plain";
    example.add("--mesh", mesh, "mesh to show");
    example.add("--count", count, "how many");
    example.add("--scale", scale, "how large");
    example.add("--quick", quick, "less work");
    example.add("--kind", kind, "which");
    ASSERT_TRUE(
        parse(example, {"--size",  "640x480", "--frames",  "10",   "--time",  "2.5",        "--image",   "a.png",
                        "--stats", "b.json",  "--adapter", "llvm", "--api",   "vulkan",     "--tracing", "software",
                        "--mesh",  "m.obj",   "--count",   "7",    "--quick", "--scale=0.5"})
            .parsed);
    EXPECT_EQ(example.width(), 640u);
    EXPECT_EQ(example.height(), 480u);
    EXPECT_NEAR(example.aspect(), 4.0f / 3.0f, 1e-6f);
    EXPECT_EQ(example.options().frames, 10u);
    EXPECT_EQ(example.options().time, 2.5);
    EXPECT_EQ(example.time(30), 2.5);
    EXPECT_EQ(example.options().image, "a.png");
    EXPECT_EQ(example.options().stats, "b.json");
    EXPECT_EQ(example.options().adapter, "llvm");
    EXPECT_EQ(example.options().api, "vulkan");
    EXPECT_EQ(example.options().tracing, TracingEngine::Software);
    EXPECT_EQ(mesh, "m.obj");
    EXPECT_EQ(count, 7u);
    EXPECT_EQ(scale, 0.5f);
    EXPECT_TRUE(quick);
    EXPECT_EQ(kind, "plain");
}

TEST(Example, TakesSeveralFiles) {
    Example example("07_splatting", "Splats.");
    std::vector<std::filesystem::path> files;
    example.add("--splats", files, "splats to show");
    ASSERT_TRUE(parse(example, {"--splats", "a.ply", "--size", "64x36", "--splats", "b c.spz"}).parsed);
    EXPECT_EQ(files, (std::vector<std::filesystem::path>{"a.ply", "b c.spz"}));
    Example other("07_splatting", "Splats.");
    other.add("--splats", files, "splats to show");
    ASSERT_TRUE(parse(other, {"--splats", "c.ply", "d.ply", "--frames", "2"}).parsed);
    EXPECT_EQ(files, (std::vector<std::filesystem::path>{"c.ply", "d.ply"}));
    Example none("07_splatting", "Splats.");
    none.add("--splats", files, "splats to show");
    EXPECT_FALSE(parse(none, {"--splats"}).parsed);
    EXPECT_EQ(none.exitCode(), 2);
}

TEST(Example, WrongArgumentsEndWithTwo) {
    const std::vector<std::vector<const char*>> cases = {{"--size"},
                                                         {"--size", "640"},
                                                         {"--size", "0x5"},
                                                         {"--size", "5x0"},
                                                         {"--size", "640x480x3"},
                                                         {"--size", "16385x1"},
                                                         {"--size", "-1x5"},
                                                         {"--size", "99999999999x1"},
                                                         {"--frames", "0"},
                                                         {"--frames", "-1"},
                                                         {"--frames", "many"},
                                                         {"--time", "-1"},
                                                         {"--time", "nan"},
                                                         {"--time", "inf"},
                                                         {"--time", "500001"},
                                                         {"--time", "1e300"},
                                                         {"--time", "soon"},
                                                         {"--tracing", "magic"},
                                                         {"--screenshot"},
                                                         {"--turn", "2"},
                                                         {"--turn", "nan"},
                                                         {"--turn", "-0.1"},
                                                         {"--many", "9"},
                                                         {"--unknown"},
                                                         {"stray"},
                                                         {"--image"}};
    for (const auto& arguments : cases) {
        Example example("05_tracing", "Rays.");
        float turn = 0.5f;
        uint32_t many = 3;
        example.addKnob("--turn", turn, 0.0f, 1.0f, "how far");
        example.addKnob("--many", many, 1u, 8u, "how many");
        const Outcome run = parse(example, arguments);
        EXPECT_FALSE(run.parsed) << arguments[0];
        EXPECT_EQ(example.exitCode(), 2) << arguments[0];
        EXPECT_TRUE(run.errors.starts_with("05_tracing: ")) << run.errors;
        EXPECT_NE(run.errors.find(arguments.back()), std::string::npos) << run.errors;
    }
}

TEST(Example, KnobsAreArgumentsToo) {
    Example example("05_tracing", "Rays.");
    float turn = 0.5f;
    uint32_t many = 3;
    bool quick = false;
    example.addKnob("--turn", turn, 0.0f, 1.0f, "how far");
    example.addKnob("--many", many, 1u, 8u, "how many");
    example.addKnob("--quick", quick, "less work");
    ASSERT_TRUE(parse(example, {"--turn", "0.25", "--many", "8", "--quick"}).parsed);
    EXPECT_EQ(turn, 0.25f);
    EXPECT_EQ(many, 8u);
    EXPECT_TRUE(quick);
    ASSERT_EQ(example.knobs().size(), 3u);
    EXPECT_EQ(example.knobs()[0].name, "turn");
    EXPECT_EQ(example.knobs()[1].help, "how many");
    EXPECT_EQ(example.knobs()[1].maximum, 8.0f);
    EXPECT_EQ(std::get<bool*>(example.knobs()[2].value), &quick);
}

TEST(Example, StartsWhereItSays) {
    Example example("05_tracing", "Rays.");
    example.setStart(4.0);
    ASSERT_TRUE(parse(example, {"--window", "--screenshot", "a.png"}).parsed);
    EXPECT_TRUE(example.options().window);
    EXPECT_FALSE(example.options().frames_given);
    EXPECT_EQ(example.options().screenshot, "a.png");
    EXPECT_EQ(example.time(30), 4.5);
    Example frozen("05_tracing", "Rays.");
    frozen.setStart(4.0);
    ASSERT_TRUE(parse(frozen, {"--time", "1", "--frames", "1"}).parsed);
    EXPECT_TRUE(frozen.options().frames_given);
    EXPECT_EQ(frozen.time(30), 1.0);
}

TEST(Example, HelpListsEveryArgument) {
    Example example("05_tracing", "Rays.");
    std::string kind = "plain";
    example.add("--kind", kind, "which kind");
    const Outcome run = parse(example, {"--help"});
    EXPECT_FALSE(run.parsed);
    EXPECT_EQ(example.exitCode(), 0);
    EXPECT_EQ(run.errors, "");
    for (const char* text : {"Rays.", "--size", "--frames", "--time", "--image", "--stats", "--adapter", "--api",
                             "--tracing", "--window", "--screenshot", "--help", "--kind", "which kind", "1600x900"})
        EXPECT_NE(run.output.find(text), std::string::npos) << text << "\n" << run.output;
}

TEST(Example, WritesPictureAndStatistics) {
    const TempDir dir;
    const std::string image = dir / "deep/er/a.png";
    const std::string stats = dir / "stats/b.json";
    Example example("05_tracing", "Rays.");
    ASSERT_TRUE(parse(example, {"--image", image.c_str(), "--stats", stats.c_str(), "--size", "2x1"}).parsed);
    EXPECT_THAT(example.saveImage(Image::create(FormatRGBAu8n, 2, 1).value()), IsOk());
    EXPECT_THAT(Image::load(image), IsOk());
    example.statistics().adapter = "llvmpipe \xff";
    example.statistics().features = {"computeTracing"};
    example.statistics().counts["triangles"] = 12;
    for (const uint64_t time : {400, 200, 300, 100}) example.statistics().addPass("trace", time);
    example.statistics().addPass("copy", 7);
    example.statistics().setRays("trace", 1000);
    EXPECT_EQ(example.finish(), 0);
    const nlohmann::json json = nlohmann::json::parse(readTextFile(stats).value());
    EXPECT_EQ(json["example"], "05_tracing");
    EXPECT_EQ(json["width"], 2);
    EXPECT_EQ(json["height"], 1);
    EXPECT_EQ(json["counts"]["triangles"], 12);
    EXPECT_EQ(json["features"][0], "computeTracing");
    EXPECT_EQ(json["passes"][0]["name"], "trace");
    EXPECT_EQ(json["passes"][0]["gpu_ns"].size(), 4u);
    EXPECT_EQ(json["passes"][0]["median_ns"], 250.0);
    EXPECT_EQ(json["passes"][0]["min_ns"], 100);
    EXPECT_EQ(json["passes"][1]["name"], "copy");
    EXPECT_DOUBLE_EQ(json["rays_per_second"].get<double>(), 4e9);
    EXPECT_FALSE(json.contains("tracing"));
}

TEST(Example, NoFilesWithoutArguments) {
    Example example("05_tracing", "Rays.");
    ASSERT_TRUE(parse(example, {}).parsed);
    EXPECT_THAT(example.saveImage(Image()), IsOk());
    EXPECT_EQ(example.finish(), 0);
}

TEST(Example, ReportPrintsTheError) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(report(Error::inFile(ErrorCode::Io, "file.open", "cannot open 'x'", {}, 0)), 1);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "cannot open 'x' [file.open]\n");
}
