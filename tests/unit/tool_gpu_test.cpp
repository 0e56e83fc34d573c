// The program `glint`, run as a program: what it prints, writes and leaves behind, and its exit status.

#include "support/hit_accuracy.h"
#include "unit/tool_test.h"

#include <glint/format/npy.h>
#include <glint/geometry/primitives.h>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <thread>

using namespace glint;
using namespace glint::test;

namespace {

void writeRays(const std::filesystem::path& path, const std::vector<Ray>& rays) {
    const auto bytes = encodeNpy({{NpyField::of<float>()}, {rays.size(), 8}}, std::as_bytes(std::span(rays)));
    ASSERT_THAT(bytes, IsOk());
    ASSERT_THAT(writeFile(path, *bytes), IsOk());
}

/// A file of rays that are all zeros, which takes no room on most file systems.
void writeZeros(const std::filesystem::path& path, uint64_t rays) {
    writeRays(path, {});
    std::string text = *readTextFile(path);
    const size_t shape = text.find("(0, 8)");
    const std::string longer = fmt::format("({}, 8)", rays);
    text.replace(shape, 6 + (longer.size() - 6), longer);  // takes the padding behind it
    const size_t comma = shape + longer.size();
    text.replace(comma, 4, ", } ");
    ASSERT_THAT(writeTextFile(path, text), IsOk());
    std::filesystem::resize_file(path, text.size() + rays * 32);
}

constexpr const char* compute = R"(
layout(local_size_x = GROUP, local_size_y = 2) in;
layout(set = 0, binding = 0) uniform Parameters { vec4 scale; uint count; };
layout(set = 0, binding = 3) readonly buffer Input { float values[]; };
layout(set = 1, binding = 3) writeonly buffer Output { uint head[4]; float results[]; };
layout(set = 1, binding = 4) uniform texture2D picture;
layout(set = 1, binding = 5) uniform sampler smooth_sampler;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) results[i] = values[i] * scale.x + textureLod(sampler2D(picture, smooth_sampler), scale.zw, 0.0).x;
}
)";

constexpr const char* query = R"(
layout(local_size_x = 64) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) buffer Hits { float hits[]; };
void main() {
    rayQueryEXT q;
    rayQueryInitializeEXT(q, scene, FLAGS, MASK, vec3(0), 0.0, vec3(hits[0], 0, 1), 10.0);
    while (rayQueryProceedEXT(q)) {}
    hits[gl_GlobalInvocationID.x] = rayQueryGetIntersectionTEXT(q, true);
}
)";

/// True if glslang's own program takes the text; also where that is not installed.
bool glslangTakes(const std::filesystem::path& file, const char* stage) {
    if (std::system("command -v glslangValidator > /dev/null") != 0) return true;
    return std::system(fmt::format("glslangValidator -S {} '{}' > /dev/null", stage, file.string()).c_str()) == 0;
}

}  // namespace

TEST_F(Tool, ArgumentsThatAreWrong) {
    expectFailure("", 2, "tool.arguments");
    expectFailure("paint", 2, "tool.arguments");
    expectFailure("cast", 2, "tool.arguments");
    expectFailure("cast a b c d", 2, "tool.arguments");
    expectFailure("info --colour", 2, "tool.arguments");
    expectFailure("shader a.comp --stage pixel", 2, "tool.arguments");
    expectFailure("shader a.comp --to latin", 2, "tool.arguments");
    expectFailure("shader a.comp --reflect --disassemble", 2, "tool.arguments");
    expectFailure("shader a.comp --json", 2, "tool.arguments");
    expectFailure("shader a.comp --validate -o a.spv", 2, "tool.arguments");
    for (const char* help : {"--help", "info --help", "shader --help", "cast --help", "splat --help",
                             "splat render --help", "splat from-mesh --help"})
        EXPECT_NE(expectSuccess(help).output.find("Options"), std::string::npos);
}

TEST_F(Tool, Info) {
    const Outcome table = expectSuccess("info");
    EXPECT_NE(table.output.find("maxStorageSize"), std::string::npos);
    const auto json = nlohmann::json::parse(expectSuccess("info --json").output, nullptr, false);
    ASSERT_TRUE(json.is_array() && !json.empty());
    EXPECT_GT(json[0]["memory_bytes"].get<uint64_t>(), 0u);
    EXPECT_GE(json[0]["limits"]["maxGroupThreads"].get<uint64_t>(), 128u);
    EXPECT_NE(table.output.find(json[0]["name"].get<std::string>()), std::string::npos);
    EXPECT_NE(table.output.find(json[0]["tracing"].get<std::string>()), std::string::npos);
    for (const std::string engine : {"software", "driver"}) {
        if (engine == "driver" && json[0]["features"].dump().find("computeTracing") == std::string::npos) continue;
        const auto picked =
            nlohmann::json::parse(expectSuccess("info --json --tracing " + engine).output, nullptr, false);
        EXPECT_TRUE(picked[0]["tracing"].get<std::string>().starts_with(engine)) << picked[0]["tracing"];
    }
    expectFailure("info --tracing magic", 2, "tool.arguments");
    expectFailure("info --adapter nonesuch", 1, "device.no_adapter");
    expectFailure("info", 1, "device.no_driver", "VK_DRIVER_FILES=/nonexistent VK_ICD_FILENAMES=/nonexistent");
    EXPECT_EQ(run("info --json", "VK_DRIVER_FILES=/nonexistent VK_ICD_FILENAMES=/nonexistent").output, "[]\n");
}

TEST_F(Tool, ShaderCompilesAndReflects) {
    write("a.comp", compute);
    expectSuccess("shader a.comp -D GROUP=8 -o a.spv");
    EXPECT_EQ(readFile(dir / "a.spv")->size() % 4, 0u);
    const std::string table = expectSuccess("shader a.spv --reflect").output;
    EXPECT_NE(table.find("8 x 2 x 1"), std::string::npos) << table;
    const auto json = nlohmann::json::parse(expectSuccess("shader a.comp -DGROUP=8 --reflect --json").output);
    ASSERT_EQ(json["resources"].size(), 5u);
    const auto& output = json["resources"][2];
    EXPECT_EQ(output["kind"], "storage");
    EXPECT_EQ(output["slot"], 1);
    EXPECT_EQ(output["set"], 1);
    EXPECT_EQ(output["binding"], 3);
    EXPECT_EQ(output["name"], "Output");
    EXPECT_EQ(output["size"], 16);
    EXPECT_EQ(output["stride"], 4);
    EXPECT_EQ(output["access"], "write");
    expectSuccess("shader a.spv --disassemble -o a.spvasm");
    EXPECT_NE(readTextFile(dir / "a.spvasm")->find("OpEntryPoint"), std::string::npos);
    expectSuccess("shader a.spvasm --stage compute --optimize --validate");
    write("b.glsl", compute);
    expectSuccess("shader b.glsl --stage compute -D GROUP=8");
    write("b.comp.glsl", compute);
    expectSuccess("shader b.comp.glsl -D GROUP=8");

    expectFailure("shader b.glsl -D GROUP=8", 2, "tool.arguments");
    expectFailure("shader a.comp", 1, "shader.compile");
    expectFailure("shader a.comp -D '1=2'", 1, "shader.macro");
    expectFailure("shader absent.comp", 1, "file.open");
    expectFailure("shader a.comp -D GROUP=8 -o absent/a.spv", 1, "file.create");
    expectFailure("shader a.spv --stage vertex", 1, "shader.stage");
    expectFailure("shader a.comp -D GROUP=8 --entry other", 1, "shader.entry");
    write("bad.spv", "no");
    expectFailure("shader bad.spv", 2, "tool.spirv");
    write("bad.spv", "no words at all.");
    expectFailure("shader bad.spv", 1, "shader.reflect");
    EXPECT_NE(run("shader a.comp").errors.find("a.comp:2:"), std::string::npos);
}

TEST_F(Tool, ShaderConverts) {
    write("a.comp", compute);
    for (const char* language : {"vulkan", "glsl", "essl", "hlsl", "msl"}) {
        SCOPED_TRACE(language);
        const std::string text =
            expectSuccess(fmt::format("shader a.comp -D GROUP=8 --to {0} -o {0}.comp", language)).output;
        EXPECT_EQ(text, "");
    }
    const std::string glsl = *readTextFile(dir / "glsl.comp");
    EXPECT_NE(glsl.find("#version 460"), std::string::npos);
    // Both storage blocks have binding 3 of their sets; OpenGL has one space for them.
    EXPECT_NE(glsl.find("binding = 0, std430) readonly buffer"), std::string::npos) << glsl;
    EXPECT_NE(glsl.find("binding = 1, std430) writeonly buffer"), std::string::npos) << glsl;
    EXPECT_NE(readTextFile(dir / "essl.comp")->find("#version 320 es"), std::string::npos);
    EXPECT_NE(readTextFile(dir / "hlsl.comp")->find("space1"), std::string::npos);
    EXPECT_NE(readTextFile(dir / "msl.comp")->find("metal_stdlib"), std::string::npos);
    EXPECT_TRUE(glslangTakes(dir / "glsl.comp", "comp"));
    EXPECT_TRUE(glslangTakes(dir / "essl.comp", "comp"));
    expectSuccess("shader vulkan.comp --validate");

    write("a.vert", "void main() { gl_Position = vec4(gl_InstanceIndex, 0, 0.5, 1); }");
    expectSuccess("shader a.vert --to glsl -o glsl.vert");
    // Depth 0..1 to -1..1.
    EXPECT_NE(readTextFile(dir / "glsl.vert")->find("gl_Position.z = 2.0 * gl_Position.z - gl_Position.w"),
              std::string::npos);
    EXPECT_TRUE(glslangTakes(dir / "glsl.vert", "vert"));
}

TEST_F(Tool, ShaderRefusesWhatItCannotConvertFaithfully) {
    write("q.comp", query);
    const std::string plain = "shader q.comp -D FLAGS=0 -D MASK=0xff --to ";
    EXPECT_NE(expectSuccess(plain + "hlsl").output.find("TraceRayInline"), std::string::npos);
    EXPECT_NE(expectSuccess(plain + "msl").output.find("intersection_query"), std::string::npos);
    EXPECT_NE(expectSuccess(plain + "vulkan").output.find("rayQueryInitializeEXT"), std::string::npos);
    expectFailure(plain + "glsl", 1, "shader.convert");
    expectFailure(plain + "essl", 1, "shader.convert");
    expectFailure("shader q.comp -D FLAGS=gl_RayFlagsOpaqueEXT -D MASK=0xff --to msl", 1, "shader.convert");
    expectFailure("shader q.comp -D FLAGS=0 -D MASK=0x0f --to msl", 1, "shader.convert");
    expectFailure("shader q.comp -D 'FLAGS=uint(hits[1])' -D MASK=0xff --to msl", 1, "shader.convert");

    write("r.rgen", "layout(binding = 0, rgba8) uniform image2D p;\n"
                    "void main() { imageStore(p, ivec2(gl_LaunchIDEXT.xy), vec4(1)); }");
    for (const char* language : {"glsl", "essl", "hlsl", "msl"})
        expectFailure(fmt::format("shader r.rgen --to {}", language), 1, "shader.convert");
    expectSuccess("shader r.rgen --to vulkan");

    write("b.comp", "layout(buffer_reference, std430) buffer Node { uint next; };\n"
                    "layout(local_size_x = 1) in;\n"
                    "layout(push_constant) uniform Push { Node node; };\n"
                    "void main() { node.next = 1; }");
    for (const char* language : {"glsl", "essl", "hlsl"})
        expectFailure(fmt::format("shader b.comp --to {}", language), 1, "shader.convert");
    expectSuccess("shader b.comp --to msl");

    write("p.comp", "layout(local_size_x = 1) in;\nvoid main() { debugPrintfEXT(\"x\"); }");
    for (const char* language : {"glsl", "hlsl", "msl"})
        expectFailure(fmt::format("shader p.comp --to {}", language), 1, "shader.convert");
    write("d.comp",
          "layout(local_size_x = 1) in;\nlayout(binding = 0) buffer B { double x; };\nvoid main() { x *= 2.0; }");
    for (const char* language : {"essl", "msl"})
        expectFailure(fmt::format("shader d.comp --to {}", language), 1, "shader.convert");
}

TEST_F(Tool, Casts) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 40, 20);
    write("torus.obj", objText(mesh));
    std::vector<Ray> rays = raysAround(mesh, 3000);
    rays[10].direction = Vector3f(0);
    writeRays(dir / "rays.npy", rays);
    const Outcome outcome = expectSuccess("cast torus.obj rays.npy hits.npy --stats stats.json");
    EXPECT_TRUE(outcome.output.starts_with("3000 rays, ")) << outcome.output;
    expectSuccess("cast torus.obj rays.npy any.npy --any");

    const Expected<NpyArray> hits = decodeNpy(*readFile(dir / "hits.npy"));
    const Expected<NpyArray> any = decodeNpy(*readFile(dir / "any.npy"));
    ASSERT_THAT(hits, IsOk());
    ASSERT_THAT(any, IsOk());
    EXPECT_EQ(describe(hits->header),
              "{t: float32, primitive: uint32, geometry: uint32, u: float32, v: float32, front: bool, 3 bytes, "
              "instance: uint32} [3000]");
    std::vector<RayHit> records(3000);
    std::memcpy(records.data(), hits->data.data(), hits->data.size());
    EXPECT_FALSE(records[10].isHit());
    uint64_t count = 0;
    const auto anything = any->values<bool>();
    ASSERT_EQ(anything.size(), 3000u);
    for (size_t i = 0; i < records.size(); i++) {
        EXPECT_EQ(anything[i], records[i].isHit()) << i;
        count += records[i].isHit();
    }
    const auto stats = nlohmann::json::parse(*readTextFile(dir / "stats.json"));
    EXPECT_EQ(stats["rays"], 3000);
    EXPECT_EQ(stats["hits"], count);
    EXPECT_EQ(stats["triangles"], 1600);
    rays.erase(rays.begin() + 10);
    records.erase(records.begin() + 10);
    const HitComparison result = compareHits(ReferenceHierarchy(mesh), rays, records);
    EXPECT_EQ(result.wrong, 0u) << result.first;

    writeRays(dir / "none.npy", {});
    expectSuccess("cast torus.obj none.npy none_hits.npy");
    EXPECT_EQ(decodeNpy(*readFile(dir / "none_hits.npy"))->header.elements(), 0u);
}

// Two tori, one of them turned about X, moved and called 9; each is hit where the float64 reference hits it alone.
TEST_F(Tool, CastsAtScenes) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 40, 20);
    std::filesystem::create_directory(dir / "sub");
    write("sub/torus.obj", objText(mesh));
    write("scene.json", R"({"meshes": {"torus": "sub/torus.obj"}, "instances": [{"mesh": "torus", "mask": 1},
        {"mesh": "torus", "translate": [20, 0, 0], "rotate": [1, 0, 0, 180], "index": 9, "mask": 2}]})");
    std::vector<Ray> rays = raysAround(mesh, 1000);
    for (size_t i = 0; i < rays.size(); i++)
        rays[i].t_max = std::min(rays[i].t_max, 5.0f / glm::length(rays[i].direction));
    const std::vector<Ray> plain = rays;
    // The same rays turned and moved with the second: signs change, and 20 has few digits to take away.
    for (const Ray& ray : plain)
        rays.push_back({{ray.origin.x + 20.0f, -ray.origin.y, -ray.origin.z},
                        ray.t_min,
                        {ray.direction.x, -ray.direction.y, -ray.direction.z},
                        ray.t_max});
    writeRays(dir / "rays.npy", rays);
    const auto cast = [&](const std::string& options) {
        expectSuccess("cast scene.json rays.npy hits.npy " + options);
        std::vector<RayHit> hits(2000);
        const Expected<NpyArray> array = decodeNpy(*readFile(dir / "hits.npy"));
        EXPECT_EQ(array->data.size(), hits.size() * sizeof(RayHit));
        if (array->data.size() == hits.size() * sizeof(RayHit))
            std::memcpy(hits.data(), array->data.data(), array->data.size());
        return hits;
    };
    const std::vector<RayHit> hits = cast("--stats stats.json");
    const auto stats = nlohmann::json::parse(*readTextFile(dir / "stats.json"));
    EXPECT_EQ(stats["instances"], 2);
    EXPECT_EQ(stats["triangles"], 1600);
    uint64_t counts[2] = {};
    for (size_t i = 0; i < hits.size(); i++) {
        if (!hits[i].isHit()) continue;
        EXPECT_EQ(hits[i].instance, i < 1000 ? 0u : 9u) << i;
        counts[i / 1000]++;
    }
    EXPECT_GT(counts[0], 300u);
    EXPECT_GT(counts[1], 300u);
    const HitComparison result =
        compareHits(ReferenceHierarchy(mesh), plain, std::vector(hits.begin(), hits.begin() + 1000));
    EXPECT_EQ(result.wrong, 0u) << result.first;
    // By either engine, where there are both: ties apart, the same.
    for (const char* engine : {"driver", "software"}) {
        if (run(std::string("cast scene.json rays.npy other.npy --tracing ") + engine).status != 0) continue;
        const std::vector<RayHit> other = cast(std::string("--tracing ") + engine + " --stats stats.json");
        EXPECT_EQ(nlohmann::json::parse(*readTextFile(dir / "stats.json"))["tracing"], engine);
        const HitComparison same =
            compareHits(ReferenceHierarchy(mesh), plain, std::vector(other.begin(), other.begin() + 1000));
        EXPECT_EQ(same.wrong, 0u) << engine << ": " << same.first;
    }
    // Those that see the first, with the first alone.
    const std::vector<RayHit> masked = cast("--mask 1");
    EXPECT_TRUE(std::equal(hits.begin(), hits.begin() + 1000, masked.begin()));
    EXPECT_TRUE(std::none_of(masked.begin() + 1000, masked.end(), [](const RayHit& hit) { return hit.isHit(); }));

    const std::vector<std::string> before = files();
    write("bad.json", R"({"meshes": {"a": "sub/torus.obj"}, "instances": [{"mesh": "a", "scale": 0}]})");
    expectFailure("cast bad.json rays.npy x.npy", 2, "scene.value");
    write("bad.json", R"({"meshes": {"a": "sub/absent.obj"}, "instances": [{"mesh": "a"}]})");
    expectFailure("cast bad.json rays.npy x.npy", 1, "file.open");
    write("sub/bad.obj", "v 0 0 x\n");
    write("bad.json", R"({"meshes": {"a": "sub/bad.obj"}, "instances": [{"mesh": "a"}]})");
    expectFailure("cast bad.json rays.npy x.npy", 2, "mesh.syntax");
    expectFailure("cast absent.json rays.npy x.npy", 1, "file.open");
    expectFailure("cast scene.json rays.npy x.npy --mask 256", 2, "tool.arguments");
    std::filesystem::remove(dir / "bad.json");
    EXPECT_EQ(files(), before);
}

TEST_F(Tool, CastLeavesNothingHalfDone) {
    write("torus.obj", objText(createTorus(1.0f, 0.4f, 20, 10)));
    write("bad.obj", "v 0 0 x\n");
    write("bad.npy", "text");
    writeZeros(dir / "rays.npy", 1000);
    const Expected<std::vector<std::byte>> flat =
        encodeNpy({{NpyField::of<float>()}, {16}}, std::vector<std::byte>(64));
    ASSERT_THAT(writeFile(dir / "flat.npy", *flat), IsOk());
    const Expected<std::vector<std::byte>> wide =
        encodeNpy({{NpyField::of<double>()}, {1, 8}}, std::vector<std::byte>(64));
    ASSERT_THAT(writeFile(dir / "wide.npy", *wide), IsOk());
    const std::vector<std::string> before = files();

    expectFailure("cast torus.obj flat.npy hits.npy", 2, "tool.rays");
    expectFailure("cast torus.obj wide.npy hits.npy", 2, "tool.rays");
    expectFailure("cast torus.obj bad.npy hits.npy", 2, "npy.magic");
    expectFailure("cast torus.obj absent.npy hits.npy", 1, "file.open");
    expectFailure("cast absent.obj rays.npy hits.npy", 1, "file.open");
    expectFailure("cast torus.txt rays.npy hits.npy", 2, "mesh.unknown_extension");
    expectFailure("cast bad.obj rays.npy hits.npy", 2, "mesh.syntax");
    expectFailure("cast torus.obj rays.npy absent/hits.npy", 1, "file.create");
    expectFailure("cast torus.obj rays.npy .", 1, "file.create");
    expectFailure("cast torus.obj rays.npy /dev/null", 1, "file.create");
    expectFailure("cast torus.obj rays.npy hits.npy --adapter nonesuch", 1, "device.no_adapter");
    EXPECT_EQ(files(), before);
}

TEST_F(Tool, CastCanBeInterrupted) {
    write("torus.obj", objText(createTorus(1.0f, 0.4f, 20, 10)));
    writeZeros(dir / "rays.npy", 100000000);
    const std::vector<std::string> before = files();
    for (const int signal : {SIGINT, SIGTERM}) {
        const pid_t child = ::fork();
        if (child == 0) {
            if (::chdir(dir.path().c_str()) != 0 || !std::freopen("/dev/null", "w", stderr)) ::_exit(9);
            ::execl(GLINT_TOOL, "glint", "cast", "torus.obj", "rays.npy", "hits.npy", nullptr);
            ::_exit(9);
        }
        ASSERT_GT(child, 0);
        // The temporary shows that the cast has begun.
        const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
        while (files() == before && std::chrono::steady_clock::now() < limit && ::waitpid(child, nullptr, WNOHANG) == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        EXPECT_NE(files(), before);
        ::kill(child, signal);
        int status = 0;
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        EXPECT_TRUE(WIFEXITED(status));
        EXPECT_EQ(WEXITSTATUS(status), 130);
        EXPECT_EQ(files(), before);
    }
}
