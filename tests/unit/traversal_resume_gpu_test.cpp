// Stages that trace are cut into pieces and gone on with when their rays have come back: whatever control flow stands
// around the traces, and whatever they need afterwards, joined pipelines compute what the driver's do.

#include "unit/random_stage.h"
#include "unit/traversal_join_gpu.h"

namespace glint::test {

namespace {

/// A ray down at the place that x chooses: squares of three instances, and gaps. The payload holds a number and how
/// many levels there are left.
constexpr const char* looking = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 1) rayPayloadEXT uvec2 payload;
uint left = 0u;
uint look(uint x) {
    payload = uvec2(x, left);
    vec3 origin = vec3(float(x % 5u) + 0.5, 0.25, 10.0);
    traceRayEXT(scene, 0u, 0xff, 0, 1, x & 1u, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0, 1);
    return payload.x;
}
uint twice(inout uint first, inout uint second) {
    if (first % 5u == 0u) return first + second;
    for (uint i = 0u; i < 2u; i++) {
        second += look(second + i);
        if (second % 4u == 1u) return second;
    }
    first ^= second;
    return first + 1u;
}
)";

/// A shader that works on a, b, c, d and t, as ray generation or as a closest-hit or miss shader that nests.
std::string stage(std::string_view body, bool is_generation) {
    std::string text = looking;
    if (is_generation)
        text += "layout(binding = 1, std430) writeonly buffer Results { uint results[]; };\n"
                "layout(push_constant) uniform Push { uint levels; };\n";
    else
        text += "layout(location = 0) rayPayloadInEXT uvec2 data;\n";
    text += "void main() {\n";
    text += is_generation ? "uint a = gl_LaunchIDEXT.x;\nleft = levels;\n"
                          : "if (data.y == 0u) { data.x = data.x * 7u + 3u; return; }\nleft = data.y - 1u;\n"
                            "uint a = data.x;\n";
    text += "uint b = a * 5u + 1u, c = 2u, d = 3u;\nuint t[3] = uint[3](a, 1u, 2u);\n" + std::string(body);
    text += std::string(is_generation ? "results[gl_LaunchIDEXT.x]" : "data.x") +
            " = a + 3u * b + 5u * c + 7u * d + 11u * t[0] + 13u * t[1] + 17u * t[2];\n}\n";
    return text;
}

}  // namespace

class TraversalResume : public TraversalJoin {
protected:
    static constexpr uint32_t rays = 19;

    void SetUp() override {
        TraversalJoin::SetUp();
        if (!device) return;
        square_ = makeSquares({0});
        std::vector<Tracing::Instance> instances;
        for (const float x : {0.0f, 1.0f, 3.0f}) instances.push_back(place(square_, x, -x, x == 1 ? 1 : 0));
        scene_ = makeTop(instances);
    }

    /// The same from both; `nested` runs in the first of two hit groups and, by `miss_nests`, in the first miss shader.
    Words compare(std::string_view generation, std::string_view nested, uint32_t levels, bool miss_nests = false,
                  bool is_optimized = true) {
        const std::string simple = "layout(location = 0) rayPayloadInEXT uvec2 data;\nvoid main() { data.x = ";
        const Pipe pipe = {
            .shaders = {{Shader::TypeRayGen, stage(generation, true), {}},
                        {Shader::TypeRayMiss, miss_nests ? stage(nested, false) : simple + "data.x / 2u + 1u; }\n", {}},
                        {Shader::TypeRayMiss, simple + "data.x * 5u + 1u; }\n", {}},
                        {Shader::TypeClosest, stage(nested, false), {}},
                        {Shader::TypeClosest, simple + "data.x * 3u + 2u; }\n", {}}},
            .depth = levels + 1,
            .is_optimized = is_optimized};
        return run(pipe, rays, rays, [&](Compute& list) {
            list.setTracing(0, scene_);
            list.setPushConstants(levels);
        });
    }
    /// In ray generation, and below it.
    void compareBoth(std::string_view body) {
        SCOPED_TRACE(body);
        compare(body, body, 1);
    }

    /// Pipelines of random stages, from this seed on.
    void compareRandom(uint32_t begin, uint32_t count) {
        for (uint32_t seed = begin; seed < begin + count; seed++) {
            RandomStage generation(2 * seed), nested(2 * seed + 1);
            const std::string above = generation.statements(3, 2), below = nested.statements(3, 2);
            SCOPED_TRACE(fmt::format("seed {}\n{}\nbelow\n{}", seed, above, below));
            compare(above, below, seed % 3, seed % 4 == 3, seed % 2 == 0);
            if (HasFailure()) return;
        }
    }

    Tracing square_, scene_;
};
using TraversalResumeLong = TraversalResume;

TEST_F(TraversalResumeLong, Branches) {
    compareBoth("if ((a & 1u) == 0u) { b = look(a); } else { c = b; if (c > 9u) d = look(c) + 1u; c++; }\nd += c;\n"
                "if (a % 3u == 0u && look(b) % 2u == 0u) c = look(d);\n"
                "t[a % 3u] = look(c) + t[2];\n");
}

TEST_F(TraversalResumeLong, LoopsWithBreaksAndContinues) {
    compareBoth("for (uint i = 0u; i < 4u; i++) {\n"
                "    if ((a + i) % 5u == 1u) continue;\n"
                "    for (uint k = 0u; k < 3u; k++) { b += look(b + k); if (b % 4u == i) break; t[k] += i; }\n"
                "    if (b % 7u == 2u) break;\n"
                "    c += b;\n}\n");
    // In the part of a loop that goes on to the next turn.
    compareBoth("for (uint i = 0u; i < 3u; i++, a = look(a + i)) { if (a % 3u == 0u) continue; b += a; }\n"
                "uint k = 0u;\ndo { c += k; } while (++k < 4u && look(c) % 4u != 0u);\n");
}

TEST_F(TraversalResume, SwitchesThatFallThrough) {
    compareBoth("for (uint i = 0u; i < 2u; i++)\n"
                "switch ((a + i) % 5u) {\n"
                "case 0u: b = look(a);\ncase 1u: c += 2u; break;\ncase 2u: if (b > 3u) { d = look(b); break; } b++;\n"
                "case 3u: d += look(d); continue;\ndefault: c = look(c) * 3u;\n}\n");
}

TEST_F(TraversalResumeLong, Functions) {
    compareBoth("a = twice(a, b);\nc = twice(c, d) + look(a);\nif (twice(t[0], a) % 2u == 0u) return;\nd = look(b);\n");
}

TEST_F(TraversalResumeLong, FiveRaysAndOnesThatMiss) {
    const char* const five = "for (uint i = 0u; i < 5u; i++) { a += look(a + i); t[i % 3u] += a; }\n";
    compare("a = look(a);\n", five, 1);
    compare("a = look(a);\n", "b = look(a * 2u) + look(b);\n", 3, true);
}

TEST_F(TraversalResume, RecursesDeep) {
    for (const uint32_t levels : {7u, 30u})
        compare("a = look(0u);\n",
                "t[a % 3u] += b;\nc = a % 4u;\nd = look(a - a % 5u + 5u * (a & 1u));\nb += t[c % 3u];\n", levels);
}

TEST_F(TraversalResume, TypesThatOutliveTraces) {
    // Two payloads, and a structure, matrices, bools and narrow and wide numbers that are needed after the second.
    const char* const text = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadInEXT uvec2 data;
layout(location = 1) rayPayloadEXT uvec2 payload;
layout(location = 2) rayPayloadEXT vec3 color;
struct Kept { mat3 turn; bool flags[2]; dvec2 wide; };
vec3 towards(vec3 value) { return value.yzx; }
void main() {
    if (data.y == 0u) { data.x = data.x * 7u + 3u; return; }
    float x = float(data.x % 64u);
    Kept kept;
    kept.turn = mat3(x, 1.0, 2.0, 3.0, x, 4.0, 5.0, 6.0, 7.0);
    kept.flags = bool[2](x > 30.0, x < 50.0);
    kept.wide = dvec2(double(x) * 0.25, 3.0lf);
    int64_t far = int64_t(data.x) << 20;
    int16_t narrow = int16_t(data.x % 100u) - int16_t(50);
    mat4x2 rows = mat4x2(x, 0.0, 1.0, x, 2.0, 3.0, 4.0, 5.0);
    vec3 origin = vec3(float(data.x % 5u) + 0.5, 0.25, 10.0);
    payload = uvec2(data.x / 3u, data.y - 1u);
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0, 1);
    color = vec3(x, 2.0, float(payload.x % 16u));
    traceRayEXT(scene, 0u, 0xff, 2, 0, 2, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0, 2);
    vec3 sum = kept.turn * towards(color);
    data.x = uint(sum.x + sum.y + sum.z) + (kept.flags[0] ? 1000u : 0u) + (kept.flags[1] ? 2000u : 0u) +
             uint(kept.wide.x * kept.wide.y) + uint(far >> 18) + uint(int(narrow) + 50) + uint(rows[1].y + rows[3].x) +
             payload.x;
}
)";
    const std::string simple = "layout(location = 0) rayPayloadInEXT uvec2 data;\nvoid main() { data.x = ";
    const std::string colors =
        "layout(location = 0) rayPayloadInEXT vec3 color;\nvoid main() { color = color.zxy + 1.0; }\n";
    const uint32_t levels = 2;
    const Pipe pipe = {.shaders = {{Shader::TypeRayGen, stage("a = look(a) + look(a * 3u);\n", true), {}},
                                   {Shader::TypeRayMiss, simple + "data.x * 5u + 1u; }\n", {}},
                                   {Shader::TypeRayMiss, simple + "data.x / 2u; }\n", {}},
                                   {Shader::TypeRayMiss, colors, {}},
                                   {Shader::TypeClosest, text, {}},
                                   {Shader::TypeClosest, simple + "data.x * 3u + 2u; }\n", {}},
                                   {Shader::TypeClosest, colors, {}},
                                   {Shader::TypeClosest, colors, {}}},
                       .depth = levels + 1};
    run(pipe, rays, rays, [&](Compute& list) {
        list.setTracing(0, scene_);
        list.setPushConstants(levels);
    });
}

TEST_F(TraversalResume, RaysChooseTheirStructures) {
    const std::string generation = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 2) uniform accelerationStructureEXT other;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(location = 1) rayPayloadEXT uvec2 payload;
void main() {
    uint x = gl_LaunchIDEXT.x;
    payload = uvec2(x, 0u);
    vec3 origin = vec3(float(x % 5u) + 0.5, 0.25, 10.0), down = vec3(0.0, 0.0, -1.0);
    for (uint i = 0u; i < 3u; i++) {
        if ((x + i) % 3u == 2u)
            traceRayEXT(other, 0u, 0xff, 0, 1, 0, origin, 0.0, down, 100.0, 1);
        else
            traceRayEXT(scene, 0u, 0xff, 0, 1, 0, origin, 0.0, down, 100.0, 1);
    }
    results[x] = payload.x;
}
)";
    const std::string simple = "layout(location = 0) rayPayloadInEXT uvec2 data;\nvoid main() { data.x = ";
    const Pipe pipe = {.shaders = {{Shader::TypeRayGen, generation, {}},
                                   {Shader::TypeRayMiss, simple + "data.x * 5u + 1u; }\n", {}},
                                   {Shader::TypeClosest, simple + "data.x * 7u + uint(gl_HitTEXT); }\n", {}},
                                   {Shader::TypeClosest, simple + "data.x * 3u + uint(gl_HitTEXT); }\n", {}}}};
    const Tracing far = makeTop({place(square_, 0, -9), place(square_, 4, -5, 1)});
    run(pipe, rays, rays, [&](Compute& list) {
        list.setTracing(0, scene_);
        list.setTracing(1, far);
    });
}

TEST_F(TraversalResume, RandomStages) { compareRandom(1, 1); }

// From seed 41 lavapipe's own pipeline makes LLVM 15 abort ("Cannot emit physreg copy instruction").
TEST_F(TraversalResumeLong, RandomStages) { compareRandom(2, 30); }

}  // namespace glint::test
