#pragma once

// Shaders with ray queries in every form that GLSL has for them.

#include "shader_test.h"

namespace glint::test {

/// A shader with ray queries.
struct RayQueryCase {
    const char* name;
    const char* text;  ///< of a compute shader, after `prologue`
    ShaderStage stage = ShaderStage::Compute;
};

/// One structure, one query's worth of arguments, somewhere to write to.
inline constexpr const char* prologue = R"(
#if COMPUTE_SHADER
layout(local_size_x = 64) in;
#define INDEX gl_GlobalInvocationID.x
#elif FRAGMENT_SHADER
layout(location = 0) out vec4 color;
#define INDEX uint(gl_FragCoord.x)
#else
#define INDEX uint(gl_VertexIndex)
#endif
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 0, binding = 1, std430) buffer Result { float result[]; };
#define RAY 0u, 0xffu, vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0
)";

inline constexpr RayQueryCase ray_query_cases[] = {
    // Every call, every getter.
    {"Initialize", "void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); }"},
    {"Proceed",
     "void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); while (rayQueryProceedEXT(q)) {} }"},
    {"Terminate", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        while (rayQueryProceedEXT(q)) rayQueryTerminateEXT(q); })"},
    {"Confirm", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        while (rayQueryProceedEXT(q)) rayQueryConfirmIntersectionEXT(q); })"},
    {"Generate", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        while (rayQueryProceedEXT(q)) rayQueryGenerateIntersectionEXT(q, 0.5); })"},
    {"TypeCommitted", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = float(rayQueryGetIntersectionTypeEXT(q, true)); })"},
    {"TypeCandidate", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = float(rayQueryGetIntersectionTypeEXT(q, false)); })"},
    {"TypeCompared", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); rayQueryProceedEXT(q);
        if (rayQueryGetIntersectionTypeEXT(q, true) == gl_RayQueryCommittedIntersectionTriangleEXT) result[0] = 1.0;
        else if (rayQueryGetIntersectionTypeEXT(q, true) >= gl_RayQueryCommittedIntersectionGeneratedEXT) result[0] = 2.0;
        else if (rayQueryGetIntersectionTypeEXT(q, false) != gl_RayQueryCandidateIntersectionAABBEXT) result[0] = 3.0; })"},
    {"T", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionTEXT(q, true) + rayQueryGetIntersectionTEXT(q, false); })"},
    {"CustomIndex", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionInstanceCustomIndexEXT(q, true) +
                    rayQueryGetIntersectionInstanceCustomIndexEXT(q, false); })"},
    {"InstanceId", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionInstanceIdEXT(q, true) + rayQueryGetIntersectionInstanceIdEXT(q, false); })"},
    {"RecordOffset", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(q, true) +
                    rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(q, false); })"},
    {"GeometryIndex", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionGeometryIndexEXT(q, true) + rayQueryGetIntersectionGeometryIndexEXT(q, false); })"},
    {"PrimitiveIndex", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionPrimitiveIndexEXT(q, true) + rayQueryGetIntersectionPrimitiveIndexEXT(q, false); })"},
    {"Barycentrics", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = dot(rayQueryGetIntersectionBarycentricsEXT(q, true), rayQueryGetIntersectionBarycentricsEXT(q, false)); })"},
    {"FrontFace", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionFrontFaceEXT(q, true) || rayQueryGetIntersectionFrontFaceEXT(q, false) ? 1 : 0; })"},
    {"BoxOpaque", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = rayQueryGetIntersectionCandidateAABBOpaqueEXT(q) ? 1.0 : 0.0; })"},
    {"ObjectRay", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = dot(rayQueryGetIntersectionObjectRayOriginEXT(q, true), rayQueryGetIntersectionObjectRayDirectionEXT(q, false)) +
                    dot(rayQueryGetIntersectionObjectRayOriginEXT(q, false), rayQueryGetIntersectionObjectRayDirectionEXT(q, true)); })"},
    {"WorldRay", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        result[0] = dot(rayQueryGetWorldRayOriginEXT(q), rayQueryGetWorldRayDirectionEXT(q)) + rayQueryGetRayTMinEXT(q) +
                    float(rayQueryGetRayFlagsEXT(q)); })"},
    {"Matrices", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        mat4x3 m = rayQueryGetIntersectionObjectToWorldEXT(q, true) + rayQueryGetIntersectionWorldToObjectEXT(q, true) +
                   rayQueryGetIntersectionObjectToWorldEXT(q, false) + rayQueryGetIntersectionWorldToObjectEXT(q, false);
        vec3 n = vec3(1.0) * mat3(m);
        result[0] = n.x + m[3].y; })"},
    // Structures.
    {"StructureArray", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[3];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scenes[1], RAY); rayQueryInitializeEXT(q, scenes[INDEX % 3u], RAY); })"},
    {"StructureArrayNonUniform", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[8];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scenes[nonuniformEXT(INDEX & 7u)], RAY); })"},
    {"StructureTable", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scenes[nonuniformEXT(INDEX)], RAY); })"},
    {"StructureArrayBySpecialization", R"(layout(constant_id = 3) const uint COUNT = 4;
        layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[COUNT];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scenes[INDEX % COUNT], RAY); })"},
    {"LargeStructureArray", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[2000];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scenes[INDEX % 2000u], RAY); })"},
    {"TwoStructures", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT other;
        void main() { rayQueryEXT q, p; rayQueryInitializeEXT(q, scene, RAY); rayQueryInitializeEXT(p, other, RAY);
        if (INDEX > 3u) { rayQueryInitializeEXT(q, other, RAY); } result[0] = float(rayQueryProceedEXT(q)) + float(rayQueryProceedEXT(p)); })"},
    {"UnusedStructure", "void main() { result[0] = 1.0; }"},
    {"UnusedStructures", R"(layout(set = 2, binding = 5) uniform accelerationStructureEXT unused[4];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); })"},
    {"StructureParameter",
     R"(void start(rayQueryEXT q, accelerationStructureEXT s) { rayQueryInitializeEXT(q, s, RAY); }
        void main() { rayQueryEXT q; start(q, scene); result[0] = float(rayQueryProceedEXT(q)); })"},
    {"StructureElementAsParameter", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[3];
        bool hit(accelerationStructureEXT s) { rayQueryEXT q; rayQueryInitializeEXT(q, s, RAY); return rayQueryProceedEXT(q); }
        void main() { result[0] = float(hit(scenes[INDEX % 3u])) + float(hit(scenes[2])) + float(hit(scene)); })"},
    {"StructureNonUniformElementAsParameter",
     R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[3];
        bool hit(accelerationStructureEXT s) { rayQueryEXT q; rayQueryInitializeEXT(q, s, RAY); return rayQueryProceedEXT(q); }
        void main() { result[0] = float(hit(scenes[nonuniformEXT(INDEX % 3u)])); })"},
    {"StructureArrayParameter", R"(layout(set = 1, binding = 0) uniform accelerationStructureEXT scenes[3];
        bool hit(accelerationStructureEXT s[3], uint i) { rayQueryEXT q; rayQueryInitializeEXT(q, s[i], RAY); return rayQueryProceedEXT(q); }
        bool pass(accelerationStructureEXT s[3], uint i) { return hit(s, i + 1u); }
        void main() { result[0] = float(pass(scenes, INDEX & 1u)); })"},
    {"StructureFromUint64", R"(layout(push_constant) uniform Push { uint64_t address; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, accelerationStructureEXT(address), RAY); })"},
    {"StructureFromUvec2", R"(layout(push_constant) uniform Push { uvec2 address; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, accelerationStructureEXT(address), RAY); })"},
    {"AliasedStructures", R"(layout(set = 0, binding = 0) uniform accelerationStructureEXT same;
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); rayQueryInitializeEXT(q, same, RAY); })"},
    {"UserVectorsLikeReferences", R"(layout(set = 1, binding = 0) uniform Block { uvec2 single; uvec2 many[4]; };
        uvec2 local[4]; uvec2 pick(uvec2 list[4], uint i) { return list[i]; }
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); local = many; result[0] = float(pick(local, INDEX & 3u).x + single.y); })"},
    // Queries.
    {"TwoQueries",
     R"(void main() { rayQueryEXT a, b; rayQueryInitializeEXT(a, scene, RAY); rayQueryInitializeEXT(b, scene, RAY);
        while (rayQueryProceedEXT(a)) { rayQueryProceedEXT(b); rayQueryConfirmIntersectionEXT(a); }
        result[0] = rayQueryGetIntersectionTEXT(a, true) - rayQueryGetIntersectionTEXT(b, true); })"},
    {"NestedQueries", R"(void main() { rayQueryEXT a; rayQueryInitializeEXT(a, scene, RAY);
        while (rayQueryProceedEXT(a)) { rayQueryEXT b; rayQueryInitializeEXT(b, scene, RAY);
            if (!rayQueryProceedEXT(b)) rayQueryConfirmIntersectionEXT(a); } })"},
    {"QueryArray",
     R"(void main() { rayQueryEXT q[3]; for (uint i = 0u; i < 3u; i++) rayQueryInitializeEXT(q[i], scene, RAY);
        for (uint i = 0u; i < 3u; i++) { while (rayQueryProceedEXT(q[i])) rayQueryConfirmIntersectionEXT(q[i]);
            result[i] = rayQueryGetIntersectionTEXT(q[i], true); } })"},
    {"QueryArrayConstantIndex",
     R"(void main() { rayQueryEXT q[2]; rayQueryInitializeEXT(q[0], scene, RAY); rayQueryInitializeEXT(q[1], scene, RAY);
        result[0] = rayQueryGetIntersectionTEXT(q[1], true); })"},
    {"GlobalQuery", R"(rayQueryEXT q; void start() { rayQueryInitializeEXT(q, scene, RAY); }
        void main() { start(); while (rayQueryProceedEXT(q)) {} result[0] = rayQueryGetIntersectionTEXT(q, true); })"},
    {"QueryParameter",
     R"(float run(rayQueryEXT q) { while (rayQueryProceedEXT(q)) {} return rayQueryGetIntersectionTEXT(q, true); }
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); result[0] = run(q); })"},
    {"QueryParameterOfSeveral",
     R"(bool step1(rayQueryEXT a, int dummy, rayQueryEXT b) { return rayQueryProceedEXT(b) || rayQueryProceedEXT(a); }
        void main() { rayQueryEXT p, q; rayQueryInitializeEXT(p, scene, RAY); rayQueryInitializeEXT(q, scene, RAY);
        result[0] = step1(p, 1, q) && step1(q, 2, p) ? 1.0 : 0.0; })"},
    {"CallChain", R"(float four(rayQueryEXT q) { return rayQueryGetIntersectionTEXT(q, true); }
        float three(rayQueryEXT q) { while (rayQueryProceedEXT(q)) {} return four(q); }
        float two(rayQueryEXT q, accelerationStructureEXT s) { rayQueryInitializeEXT(q, s, RAY); return three(q); }
        float one(accelerationStructureEXT s) { rayQueryEXT q; return two(q, s); }
        void main() { result[0] = one(scene); })"},
    {"QueryInLoop", R"(void main() { for (int i = 0; i < 4; i++) { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        if (i == 2) continue; if (rayQueryProceedEXT(q)) break; result[i] = rayQueryGetIntersectionTEXT(q, true); } })"},
    {"QueryInSwitch", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); switch (INDEX & 3u) {
        case 0u: rayQueryProceedEXT(q); break; case 1u: rayQueryTerminateEXT(q); default: result[0] = 2.0; } })"},
    {"QueryInConditions", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        bool found = INDEX > 3u && rayQueryProceedEXT(q) || rayQueryGetIntersectionTypeEXT(q, true) == 1u;
        result[0] = found ? rayQueryGetIntersectionTEXT(q, true) : 0.0; })"},
    {"TwoFunctionsWithQueries",
     R"(bool shadow(vec3 o) { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 4u, 0xffu, o, 0.0, vec3(1.0), 9.0); rayQueryProceedEXT(q);
        return rayQueryGetIntersectionTypeEXT(q, true) != 0u; }
        float trace(vec3 o) { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xffu, o, 0.0, vec3(1.0), 9.0); rayQueryProceedEXT(q);
        return shadow(o) ? 0.0 : rayQueryGetIntersectionTEXT(q, true); }
        void main() { result[0] = trace(vec3(1.0)) + trace(vec3(2.0)); })"},
    {"RuntimeArguments",
     R"(layout(push_constant) uniform Push { vec3 origin; uint flags; vec3 direction; uint mask; float low, high; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, flags | gl_RayFlagsOpaqueEXT, mask, origin, low, direction * 2.0, high);
        result[0] = float(rayQueryProceedEXT(q)); })"},
    {"AllFlags",
     R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsNoOpaqueEXT |
        gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT | gl_RayFlagsCullBackFacingTrianglesEXT |
        gl_RayFlagsCullFrontFacingTrianglesEXT | gl_RayFlagsCullOpaqueEXT | gl_RayFlagsCullNoOpaqueEXT, 0xff, vec3(0), 0.0, vec3(1), 1.0); })"},
    {"PrimitiveCulling", R"(layout(primitive_culling);
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, gl_RayFlagsSkipTrianglesEXT | gl_RayFlagsSkipAABBEXT, 0xff, vec3(0), 0.0, vec3(1), 1.0); })"},
    // What has to survive beside the queries.
    {"Precise", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        precise float x = result[0] * result[1] + result[2]; result[3] = x; })"},
    {"SpecializationConstants",
     R"(layout(constant_id = 1) const float SCALE = 2.0; layout(constant_id = 2) const uint FLAGS = 1u;
        layout(constant_id = 4) const bool SHADOWS = true;
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, FLAGS + 1u, 0xff, vec3(0), 0.0, vec3(SCALE), 1.0);
        if (SHADOWS) result[0] = rayQueryGetIntersectionTEXT(q, true) * SCALE; })"},
    {"GroupSizeBySpecialization", R"(layout(local_size_x_id = 7) in;
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); result[INDEX] = float(gl_WorkGroupSize.x); })"},
    {"BufferReferences",
     R"(layout(buffer_reference) buffer Node; layout(buffer_reference, std430, buffer_reference_align = 16) buffer Node { vec4 value; Node next; };
        layout(push_constant) uniform Push { Node head; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xff, head.next.value.xyz, 0.0, head.value.xyz, 1.0); head.value.w = 1.0; })"},
    {"Subgroups",
     R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); bool hit = rayQueryProceedEXT(q);
        result[INDEX] = float(subgroupAdd(hit ? 1u : 0u)) + float(subgroupBallot(hit).x) + subgroupBroadcastFirst(result[0]); })"},
    {"SmallTypes",
     R"(layout(set = 0, binding = 2, std430) buffer Small { float16_t h; uint8_t b; int16_t s; f16vec2 v; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); h = float16_t(rayQueryGetIntersectionTEXT(q, true)); b = uint8_t(s); })"},
    {"WideTypes", R"(layout(set = 0, binding = 2, std430) buffer Wide { double d; int64_t i; uint64_t u; dvec3 v; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); d = double(rayQueryGetIntersectionTEXT(q, true)) * v.x; u = uint64_t(i); })"},
    {"RowMajor",
     R"(layout(row_major, set = 0, binding = 2) uniform Camera { mat4 view; mat4x3 rows; layout(column_major) mat3 columns; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xff, rows * vec4(1.0), 0.0, columns * (view * vec4(1.0)).xyz, 1.0); })"},
    {"Atomics", R"(layout(set = 0, binding = 2, std430) buffer Counter { uint counter; uint64_t wide; };
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); if (rayQueryProceedEXT(q)) atomicAdd(counter, 1u); atomicMax(wide, 5ul); })"},
    {"SharedMemory", R"(shared float values[64];
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); values[gl_LocalInvocationIndex] = rayQueryGetIntersectionTEXT(q, true);
        barrier(); result[INDEX] = values[63u - gl_LocalInvocationIndex]; })"},
    {"ImagesAndSamplers",
     R"(layout(set = 0, binding = 2, rgba8) uniform image2D picture; layout(set = 0, binding = 3) uniform texture2D textures[4];
        layout(set = 0, binding = 4) uniform sampler filters; layout(set = 0, binding = 5) uniform sampler2D combined; layout(set = 0, binding = 6) uniform textureBuffer texels;
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); vec2 uv = rayQueryGetIntersectionBarycentricsEXT(q, true);
        imageStore(picture, ivec2(INDEX), textureLod(sampler2D(textures[nonuniformEXT(INDEX & 3u)], filters), uv, 0.0) + textureLod(combined, uv, 0.0) + texelFetch(texels, 0)); })"},
    {"Structs",
     R"(struct Ray { vec3 origin; float low; vec3 direction; float high; }; struct Hit { float t; vec2 uv; ivec3 ids; bool front; };
        Hit trace(Ray r) { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xff, r.origin, r.low, r.direction, r.high); while (rayQueryProceedEXT(q)) {}
        return Hit(rayQueryGetIntersectionTEXT(q, true), rayQueryGetIntersectionBarycentricsEXT(q, true), ivec3(rayQueryGetIntersectionInstanceIdEXT(q, true),
        rayQueryGetIntersectionGeometryIndexEXT(q, true), rayQueryGetIntersectionPrimitiveIndexEXT(q, true)), rayQueryGetIntersectionFrontFaceEXT(q, true)); }
        void main() { Hit hits[2]; hits[0] = trace(Ray(vec3(0), 0.0, vec3(1), 1.0)); hits[1] = trace(Ray(hits[0].uv.xyx, 0.0, vec3(1), hits[0].t));
        result[0] = hits[INDEX & 1u].t; })"},
    {"NamesLikeTheLibrarys", R"(struct GlintQuery { int a; }; struct GlintHit { float b; }; float glint_words[3];
        float glintQueryProceed(GlintQuery q) { return float(q.a) + glint_words[1]; }
        void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); rayQueryProceedEXT(q); GlintHit h; h.b = glintQueryProceed(GlintQuery(3)); result[0] = h.b; })"},
    {"EarlyReturn", R"(void main() { if (INDEX > 100u) return; rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        for (;;) { if (!rayQueryProceedEXT(q)) { result[0] = 1.0; return; } } })"},
    {"Printf",
     R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); debugPrintfEXT("t %f", rayQueryGetIntersectionTEXT(q, true)); })"},
    {"OutParameters",
     R"(bool hit(out float t, inout uint n, accelerationStructureEXT s) { rayQueryEXT q; rayQueryInitializeEXT(q, s, RAY); n++; t = rayQueryGetIntersectionTEXT(q, true);
        return rayQueryProceedEXT(q); } void main() { float t; uint n = 3u; if (hit(t, n, scene)) result[n] = t; })"},
    {"Unrolled",
     R"(void main() { [[unroll]] for (int i = 0; i < 3; i++) { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); [[branch]] if (rayQueryProceedEXT(q)) result[i] = 1.0; } })"},
    // Other stages.
    {"Fragment", R"(void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); rayQueryProceedEXT(q);
        if (rayQueryGetIntersectionTypeEXT(q, true) == 0u) discard; color = vec4(rayQueryGetIntersectionTEXT(q, true)); })",
     ShaderStage::Fragment},
    {"FragmentDerivatives",
     R"(layout(location = 0) in vec2 uv; void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xff, vec3(uv, dFdx(uv.x)), 0.0, vec3(1), 1.0);
        rayQueryProceedEXT(q); color = vec4(fwidth(rayQueryGetIntersectionTEXT(q, true))); gl_FragDepth = 0.5; })",
     ShaderStage::Fragment},
    {"Vertex",
     R"(layout(location = 0) in vec3 position; void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, 0u, 0xff, position, 0.0, vec3(1), 1.0);
        rayQueryProceedEXT(q); gl_Position = vec4(position, rayQueryGetIntersectionTEXT(q, true)); })",
     ShaderStage::Vertex},
    {"FragmentTwoTargets",
     R"(layout(location = 1) out uvec4 ids; layout(location = 2) flat in uint index; void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY);
        ids = uvec4(rayQueryGetIntersectionInstanceIdEXT(q, true), index, INDEX, 1u); color = vec4(1.0); })",
     ShaderStage::Fragment},
};

inline const char* stageMacro(ShaderStage stage) {
    return stage == ShaderStage::Fragment ? "FRAGMENT_SHADER=1"
           : stage == ShaderStage::Vertex ? "VERTEX_SHADER=1"
                                          : "COMPUTE_SHADER=1";
}

inline ShaderSource sourceOf(const RayQueryCase& item) {
    return glsl(std::string(prologue) + item.text, item.stage, stageMacro(item.stage));
}

}  // namespace glint::test
