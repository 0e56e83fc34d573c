// Pipelines joined into one compute shader compute what the driver's ray-tracing pipeline computes of the same stages.

#include "unit/traversal_join_gpu.h"

#include <cstring>

namespace glint::test {

namespace {

const RayShader down = {Shader::TypeRayGen, look_down, {}};
const RayShader miss_one = {Shader::TypeRayMiss, setPayload("1u"), {}};
constexpr Tracing::Flags transparent = Tracing::FlagFastTrace | Tracing::FlagTransparent;

}  // namespace

TEST_F(TraversalJoin, MissesAndHits) {
    const Tracing squares = makeSquares({0, 1});
    std::vector<Tracing::Instance> instances = {place(squares, 0, 0), place(squares, 4, -2, 1)};
    instances[1].data = 77;
    const Tracing scene = makeTop(instances);
    const Pipe pipe = {{down,
                        miss_one,
                        {Shader::TypeRayMiss, setPayload("payload + gl_LaunchIDEXT.x + gl_LaunchSizeEXT.x"), {}},
                        {Shader::TypeClosest, setPayload("100u + gl_HitKindEXT + uint(gl_GeometryIndexEXT)"), {}},
                        {Shader::TypeClosest,
                         setPayload("uint(gl_HitTEXT) * 10000u + gl_InstanceCustomIndexEXT * 10u + "
                                    "uint(gl_GeometryIndexEXT) + uint(gl_ObjectRayOriginEXT.z + "
                                    "gl_ObjectToWorldEXT[3].x + gl_WorldToObjectEXT[3].z) * 1000000u"),
                         {}}}};
    const Words found = look(pipe, scene, 7);
    EXPECT_EQ(found[0], 100 + 0xfeu);
    EXPECT_EQ(found[1], 101 + 0xfeu);
    EXPECT_EQ(found[2], 1u);
    EXPECT_EQ(found[4], 12 * 10000 + 770u + 18 * 1000000);
    EXPECT_EQ(look(pipe, scene, 7, {.miss = 1})[3], 7 + 3 + 7u);
    look(pipe, scene, 7, {.offset = 1, .stride = 1});
    look(pipe, scene, 7, {.flags = RaySkipClosest});
    look(pipe, scene, 7, {.flags = RayCullBack});
    look(pipe, scene, 7, {.mask = 0});
}

TEST_F(TraversalJoin, AnyHitEndsFromWithinItsFunctions) {
    const Tracing square = makeSquares({0}, 0, transparent);
    std::vector<Tracing::Instance> instances;
    for (uint32_t i = 0; i < 5; i++) {
        instances.push_back(place(square, 0, -static_cast<float>(i)));
        instances.back().data = i;
    }
    const Tracing scene = makeTop(instances);
    // The payload counts the calls that go on to their end, in its upper half those that begin.
    const auto pipe = [](std::string_view condition, const char* end) {
        return Pipe{{down,
                     {Shader::TypeRayMiss, setPayload("payload + 50u"), {}},
                     {Shader::TypeClosest, setPayload("payload + 1000u * (1u + gl_InstanceCustomIndexEXT)"), {}},
                     {Shader::TypeFirstHit,
                      "layout(location = 0) rayPayloadInEXT uint payload;\n"
                      "uint judge(uint value) {\n"
                      "    for (int i = 0; i < 3; i++) { if (i == 1 && " +
                          std::string(condition) + ") { " + end +
                          "; } }\n    return value;\n}\n"
                          "uint outer(uint value) { return value == 0u ? 0u : judge(value) + judge(value); }\n"
                          "void main() { uint x = outer(1u); payload += x / 2u; }\n",
                      {}}}};
    };
    EXPECT_EQ(look(pipe("gl_InstanceCustomIndexEXT < 3", "ignoreIntersectionEXT"), scene, 2)[1], 57u);
    EXPECT_EQ(look(pipe("true", "ignoreIntersectionEXT"), scene, 2)[0], 57u);
    // Which of them comes first is not said: with one instance alone it is.
    const Tracing alone = makeTop({instances[2]});
    EXPECT_EQ(look(pipe("true", "terminateRayEXT"), alone, 2)[0], 7 + 3000u);
    EXPECT_EQ(look(pipe("false", "terminateRayEXT"), alone, 2)[0], 8 + 3000u);
}

TEST_F(TraversalJoin, IntersectionsReport) {
    const Tracing boxes = makeBoxes({{0, 0, -1, 1, 1, 1}, {0, 0, -3, 1, 1, -2}}, transparent);
    const Tracing scene = makeTop({place(boxes)});
    const RayShader closest = {Shader::TypeClosest,
                               "layout(location = 0) rayPayloadInEXT uint payload;\n"
                               "struct Data { uvec3 values; float more[2]; };\nhitAttributeEXT Data data;\n"
                               "void main() { payload = (data.values.x + data.values.z) << 16 | gl_HitKindEXT << 8 | "
                               "uint(gl_HitTEXT * 2.0 + data.more[1]); }\n",
                               {}};
    const RayShader intersection = {Shader::TypeIntersection,
                                    "struct Data { uvec3 values; float more[2]; };\nhitAttributeEXT Data data;\n"
                                    "bool report(float t, uint kind) {\n"
                                    "    data.values = uvec3(kind, 1u, uint(gl_PrimitiveID));\n"
                                    "    data.more[1] = gl_RayTmaxEXT < 50.0 ? 40.0 : 0.0;\n"
                                    "    return reportIntersectionEXT(t, kind);\n"
                                    "}\n"
                                    "void main() {\n"
                                    "    float t = 12.0 - 4.0 * float(gl_PrimitiveID);\n"
                                    "    if (report(t, 3u)) report(t - 1.0, 4u); else report(t + 3.0, 5u);\n"
                                    "}\n",
                                    {}};
    const Pipe plain = {{down, miss_one, intersection, closest}};
    look(plain, scene, 2);
    look(plain, scene, 2, {.flags = RayOpaque});
    const Pipe judged = {{down,
                          miss_one,
                          intersection,
                          closest,
                          {Shader::TypeFirstHit,
                           "hitAttributeEXT uvec4 data;\nvoid main() { if (gl_HitKindEXT == 3u && data.x == 3u && "
                           "gl_HitTEXT < 20.0) ignoreIntersectionEXT; }\n",
                           {}}}};
    look(judged, scene, 2);
    look(judged, scene, 2, {.flags = RayOpaque});
}

TEST_F(TraversalJoin, RecordsAndCallables) {
    const Tracing square = makeSquares({0, 1, 2});
    const Tracing scene = makeTop({place(square)});
    const std::string record = "struct Part { vec2 place; uint index; };\n"
                               "layout(shaderRecordEXT, std430) readonly buffer Record { uint first; vec3 color; Part "
                               "parts[2]; mat3 turn; };\n";
    const std::string closest =
        record +
        "layout(location = 0) rayPayloadInEXT uint payload;\nlayout(location = 1) callableDataEXT uvec2 data;\n"
        "void main() {\n"
        "    int which = gl_GeometryIndexEXT & 1;\n"
        "    data = uvec2(first, payload);\n"
        "    executeCallableEXT(parts[which].index, 1);\n"
        "    payload = data.x + uint(color.z + parts[which].place.y + turn[2][1] * 100.0);\n"
        "}\n";
    Words words(32);
    const auto put = [&](size_t at, float value) { std::memcpy(&words[at], &value, 4); };
    words[0] = 11;
    for (size_t i = 0; i < 3; i++) put(4 + i, 20.0f + static_cast<float>(i));
    put(9, 100);
    words[10] = 0;
    put(13, 200);
    words[14] = 1;
    for (size_t i = 0; i < 12; i++) put(16 + i, static_cast<float>(i));
    Words other = words;
    other[0] = 500;
    const Pipe pipe = {
        {down,
         {Shader::TypeRayMiss,
          "layout(location = 0) rayPayloadInEXT uint payload;\nlayout(location = 1) callableDataEXT uvec2 data;\n"
          "void main() { data = uvec2(1u, 2u); executeCallableEXT(2, 1); payload = data.x; }\n",
          {}},
         {Shader::TypeClosest, closest, {}},
         {Shader::TypeCallable,
          "layout(location = 0) callableDataInEXT uvec2 data;\nvoid main() { data.x += 1000u * data.y; }\n",
          {}},
         {Shader::TypeCallable,
          "layout(location = 0) callableDataInEXT uvec2 data;\nlayout(location = 1) callableDataEXT uvec2 inner;\n"
          "layout(shaderRecordEXT, std430) readonly buffer Record { uint amount; };\n"
          "void main() { inner = data.yx; executeCallableEXT(0, 1); data.x = inner.x * amount; }\n",
          {}}},
        1,
        {{TraversalSource::Hit, 0, words},
         {TraversalSource::Hit, 0, other},
         {TraversalSource::Hit, 0, words},
         {TraversalSource::Callable, 0, {}},
         {TraversalSource::Callable, 1, {3}},
         {TraversalSource::Callable, 1, {5}}}};
    const Words found = look(pipe, scene, 4, {.stride = 1});
    EXPECT_EQ(found[0], 11 + 7000 + 22 + 100 + 900u);
    EXPECT_EQ(found[3], (2 + 1000) * 5u);
}

TEST_F(TraversalJoin, NestedRaysLeaveTheirCallersAlone) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square), place(square, 0, -4), place(square, 1, -4)});
    // Looks again from behind the hit; everything of its own is as it was after that.
    const std::string closest = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(constant_id = 0) const uint most = 1u;
layout(location = 0) rayPayloadInEXT uvec3 payload;
layout(location = 1) rayPayloadEXT uvec3 inner;
layout(shaderRecordEXT, std430) readonly buffer Record { uint amount; };
hitAttributeEXT vec2 place;
uint calls = 5u;
void main() {
    calls += payload.y;
    inner = uvec3(0u, payload.y + 1u, 0u);
    float x = place.x;
    int instance = gl_InstanceID;
    if (payload.y < most) {
        vec3 origin = gl_WorldRayOriginEXT + gl_WorldRayDirectionEXT * (gl_HitTEXT + 0.5);
        traceRayEXT(scene, 0u, 0xff, 0, 0, 0, origin, 0.0, gl_WorldRayDirectionEXT, 100.0, 1);
    }
    payload.x = inner.x + uint(gl_HitTEXT) + 100u * uint(INSTANCE) + (x == place.x ? 0u : 1u);
    payload.z = inner.z * 10u + amount * calls;
}
)";
    const std::string generation = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uvec3 results[]; };
layout(location = 0) rayPayloadEXT uvec3 payload;
void main() {
    payload = uvec3(0u);
    vec3 origin = vec3(float(gl_LaunchIDEXT.x) + 0.5, 0.25, 10.0);
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
    results[gl_LaunchIDEXT.x] = payload;
}
)";
    const RayShader miss = {Shader::TypeRayMiss,
                            "layout(location = 0) rayPayloadInEXT uvec3 payload;\nvoid main() { payload = uvec3(0u, "
                            "9u, 3u); }\n",
                            {}};
    for (const uint32_t depth : {2u, 3u}) {
        Pipe pipe = {{{Shader::TypeRayGen, generation, {}}, miss, {Shader::TypeClosest, closest, "INSTANCE=instance"}},
                     depth,
                     {{TraversalSource::Hit, 0, {7}}},
                     {{0, depth - 1}}};
        const auto bind = [&](Compute& list) { list.setTracing(0, scene); };
        const Words found = run(pipe, 12, 3, bind);
        // Two hits, and with a third level the miss beyond them.
        EXPECT_EQ(found[0], 10 + 3 + 100u);
        EXPECT_EQ(found[2], (depth == 3 ? 30 * 10u : 0) + 10 * 7 * 6u + 7 * 5u);
        // lavapipe's own pipelines tell the inner ray's instance afterwards.
        pipe.shaders[2].macros = "INSTANCE=gl_InstanceID";
        EXPECT_EQ(runJoined(pipe, 12, 3, bind), found);
    }
}

}  // namespace glint::test
