// What the stages of a ray-tracing pipeline share when they run as one compute shader: the frame, by which they hand on
// what Vulkan hands on between shaders, the search, and the records of the binding table. After this follows what
// core/shader/traversal_skeleton.cpp writes, which calls the stages; core/shader/traversal_copier.cpp copies the frame to
// the variables of a stage before it runs.
//
// Before it are defined: GLINT_JOIN_SET, the set of the two blocks; GLINT_DEPTH, the levels of recursion at which stages
// may trace; GLINT_PAYLOAD_WORDS, GLINT_CALLABLE_WORDS, GLINT_ATTRIBUTE_WORDS, GLINT_PUSH_WORDS and GLINT_SAVED_WORDS,
// lengths of at least 1, the attributes' of at least 2; and GLINT_USES_... for what costs time to know.
#pragma once

// Four tables (ray generation, miss, hit, callable): x the first word, y the words of a record, z how many there are.
// A record is the index of its group and then its data.
layout(set = GLINT_JOIN_SET, binding = GLINT_JOIN_BINDING, std430) readonly buffer GlintRecords { uint words[]; }
glint_records;
// Rays in three dimensions, and the record of the ray-generation shader.
layout(set = GLINT_JOIN_SET, binding = GLINT_JOIN_BINDING + 1) uniform GlintLaunch { uvec4 rays; } glint_launch;
#ifdef GLINT_USES_PUSH
layout(push_constant, std430) uniform GlintPush { uint words[GLINT_PUSH_WORDS]; } glint_push;
#endif

const uint GLINT_NO_RECORD = 0xffffffffu;
const uint GLINT_TABLE_GENERATION = 0u;
const uint GLINT_TABLE_MISS = 1u;
const uint GLINT_TABLE_HIT = 2u;
const uint GLINT_TABLE_CALLABLE = 3u;

// The frame: what the stage that begins next, or the innermost that runs, is to know.
uvec3 glint_launch_id;
uvec3 glint_launch_size;
uint glint_ray_flags;
uint glint_cull_mask;
vec3 glint_world_origin;
vec3 glint_world_direction;
vec3 glint_object_origin;
vec3 glint_object_direction;
float glint_t_min;
float glint_t_max;
uint glint_hit_kind;
int glint_primitive;
int glint_instance;
int glint_custom_index;
int glint_geometry;
mat4x3 glint_to_world;
mat4x3 glint_to_object;
// Of the ray that is asked for.
uint glint_ray_offset;
uint glint_ray_stride;
uint glint_ray_miss;
float glint_ray_end;
uint glint_structure;         // which of those that stages trace
uvec2 glint_structure_place;  // its index in an array, or its address
uint glint_record;  // first word of its record's data
uint glint_payload[GLINT_PAYLOAD_WORDS];
uint glint_callable[GLINT_CALLABLE_WORDS];
uint glint_attributes[GLINT_ATTRIBUTE_WORDS];

// Any-hit shaders: the intersection is ignored, or ends the search. Both, and a report that ended the search, set
// glint_unwind, at which functions of a stage return.
bool glint_ignored;
bool glint_ended;
bool glint_unwind;

// The box that an intersection shader is about: what it has reported and any-hit shaders have taken.
uint glint_group;
bool glint_opaque;
bool glint_reported;
uint glint_reported_kind;
uint glint_reported_attributes[GLINT_ATTRIBUTE_WORDS];

// Which stage runs, and the piece of it that is next: stages that call traceRayEXT are cut into pieces, and return at the
// call. What stages that nest have to find again is kept for each level of recursion but ray generation's, where there is
// one of them only.
const uint GLINT_NO_STAGE = 0xffffu;
uint glint_stage;
uint glint_piece;
uint glint_level;
bool glint_asks;
uint glint_generation;  // stage and piece that wait, and below
#if GLINT_DEPTH > 1
// Of a single level the place does not depend on the level, which compilers are slow with.
#define GLINT_FRAME (GLINT_DEPTH == 2 ? 0u : glint_level - 1u)
uint glint_callers[GLINT_DEPTH - 1];
uint glint_saved[(GLINT_DEPTH - 1) * GLINT_SAVED_WORDS];
#endif
rayQueryEXT glint_query;

// Finds a record: sets glint_record and returns its group, GLINT_NO_RECORD if the table has no such record.
uint glintFindRecord(const uint table, const uint index) {
    if (index >= glint_records.words[4u * table + 2u]) return GLINT_NO_RECORD;
    const uint word = glint_records.words[4u * table] + index * glint_records.words[4u * table + 1u];
    glint_record = word + 1u;
    return glint_records.words[word];
}

// Puts what an intersection is like into the frame, all but its distance and kind, and its group into `group`. A macro,
// as which intersection is meant has to be a constant; parts are empty where no stage asks for them.
#ifdef GLINT_USES_CUSTOM_INDEX
#define GLINT_TELL_CUSTOM_INDEX(committed) \
    glint_custom_index = rayQueryGetIntersectionInstanceCustomIndexEXT(glint_query, committed);
#else
#define GLINT_TELL_CUSTOM_INDEX(committed)
#endif
#ifdef GLINT_USES_OBJECT_RAY
#define GLINT_TELL_OBJECT_RAY(committed)                                                      \
    glint_object_origin = rayQueryGetIntersectionObjectRayOriginEXT(glint_query, committed); \
    glint_object_direction = rayQueryGetIntersectionObjectRayDirectionEXT(glint_query, committed);
#else
#define GLINT_TELL_OBJECT_RAY(committed)
#endif
#ifdef GLINT_USES_TO_WORLD
#define GLINT_TELL_TO_WORLD(committed) \
    glint_to_world = rayQueryGetIntersectionObjectToWorldEXT(glint_query, committed);
#else
#define GLINT_TELL_TO_WORLD(committed)
#endif
#ifdef GLINT_USES_TO_OBJECT
#define GLINT_TELL_TO_OBJECT(committed) \
    glint_to_object = rayQueryGetIntersectionWorldToObjectEXT(glint_query, committed);
#else
#define GLINT_TELL_TO_OBJECT(committed)
#endif
#define GLINT_TELL(committed, group)                                                                                \
    glint_primitive = rayQueryGetIntersectionPrimitiveIndexEXT(glint_query, committed);                             \
    glint_instance = rayQueryGetIntersectionInstanceIdEXT(glint_query, committed);                                  \
    glint_geometry = rayQueryGetIntersectionGeometryIndexEXT(glint_query, committed);                               \
    GLINT_TELL_CUSTOM_INDEX(committed)                                                                              \
    GLINT_TELL_OBJECT_RAY(committed)                                                                                \
    GLINT_TELL_TO_WORLD(committed)                                                                                  \
    GLINT_TELL_TO_OBJECT(committed)                                                                                 \
    group = glintFindHit(rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(glint_query, committed))

uint glintFindHit(const uint instance_offset) {
    const uint index = instance_offset + uint(glint_geometry) * (glint_ray_stride & 15u) + (glint_ray_offset & 15u);
    return glintFindRecord(GLINT_TABLE_HIT, index);
}

// What traceRayEXT begins with, but for the structure: the stage that calls it returns after this, and goes on when the
// ray has come back.
void glintAsk(const uint flags, const uint mask, const uint offset, const uint stride, const uint miss,
              const vec3 origin, const float t_min, const vec3 direction, const float t_max) {
    glint_ray_flags = flags;
    glint_cull_mask = mask & 0xffu;
    glint_ray_offset = offset;
    glint_ray_stride = stride;
    glint_ray_miss = miss & 0xffffu;
    glint_world_origin = origin;
    glint_t_min = t_min;
    glint_world_direction = direction;
    glint_ray_end = t_max;
    glint_asks = true;
}

// The stage that has asked waits, and the one that its ray finds comes next.
void glintCall() {
    const uint caller = glint_piece << 16 | glint_stage;
#if GLINT_DEPTH > 1
    if (glint_level > 0u)
        glint_callers[GLINT_FRAME] = caller;
    else
#endif
        glint_generation = caller;
    glint_level++;
    glint_stage = GLINT_NO_STAGE;
    glint_piece = 0u;
}

// Where no stage runs any more: the one that waits goes on.
void glintReturn() {
    glint_level--;
    uint caller = glint_generation;
#if GLINT_DEPTH > 1
    if (glint_level > 0u) caller = glint_callers[GLINT_FRAME];
#endif
    glint_stage = caller & 0xffffu;
    glint_piece = caller >> 16;
}

// The stages' calls are written by traversal_skeleton.cpp.
void glintRunFirstHit(const uint group);
void glintRunIntersection(const uint group);
// Begins the query where the ray asks for it, with these flags.
void glintBegin(const uint flags) {}

// A triangle that is no opaque one: true if it is there.
bool glintAskTriangle() {
    uint group;
    GLINT_TELL(false, group);
    const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(glint_query, false);
    glint_attributes[0] = floatBitsToUint(barycentrics.x);
    glint_attributes[1] = floatBitsToUint(barycentrics.y);
    glint_t_max = rayQueryGetIntersectionTEXT(glint_query, false);
    glint_hit_kind = rayQueryGetIntersectionFrontFaceEXT(glint_query, false) ? 0xfeu : 0xffu;
    glint_ignored = false;
    glint_ended = false;
    glint_unwind = false;
    glintRunFirstHit(group);
    return !glint_ignored;
}

// A box whose content ends before `limit`, as far as is known: true if its intersection shader has reported a hit that
// is taken; glint_t_max is its distance.
bool glintAskBox(const float limit) {
    GLINT_TELL(false, glint_group);
    glint_opaque = rayQueryGetIntersectionCandidateAABBOpaqueEXT(glint_query);
    glint_t_max = limit;
    glint_hit_kind = 0u;
    glint_reported = false;
    glint_ended = false;
    glint_unwind = false;
    glintRunIntersection(glint_group);
    return glint_reported;
}

// reportIntersectionEXT, whose attributes are in glint_attributes.
bool glintReport(const float t, const uint kind) {
    const float limit = glint_t_max;
    if (!(t >= glint_t_min && t <= limit)) return false;
    if (!glint_opaque) {
        glint_t_max = t;
        glint_hit_kind = kind;
        glint_ignored = false;
        glint_unwind = false;
        glintRunFirstHit(glint_group);
        glint_t_max = limit;
        glint_unwind = glint_ended;
        if (glint_ignored) return false;
    }
    glint_t_max = t;
    glint_reported = true;
    glint_reported_kind = kind;
    for (int i = 0; i < GLINT_ATTRIBUTE_WORDS; i++) glint_reported_attributes[i] = glint_attributes[i];
    if ((glint_ray_flags & gl_RayFlagsTerminateOnFirstHitEXT) != 0u) glint_ended = true;
    glint_unwind = glint_ended;
    return true;
}

// A ray's search. Afterwards the frame tells the closest hit; returns the group of its record, or GLINT_NO_RECORD. `hits`
// says whether there is one at all.
uint glintSearch(out bool hits) {
    // Flags of pipelines alone are none of a query's.
    uint flags = glint_ray_flags & ~gl_RayFlagsSkipClosestHitShaderEXT;
#if !defined(GLINT_USES_FIRST_HIT) && !defined(GLINT_USES_INTERSECTION)
    // There is nobody to ask about a triangle, so that it may as well be opaque, unless it is culled for being that.
    if ((flags & (gl_RayFlagsCullOpaqueEXT | gl_RayFlagsCullNoOpaqueEXT)) == 0u)
        flags = (flags & ~gl_RayFlagsNoOpaqueEXT) | gl_RayFlagsOpaqueEXT;
#endif
    glintBegin(flags);
#ifdef GLINT_USES_INTERSECTION
    uint box_kind = 0u;
    uint box_attributes[GLINT_ATTRIBUTE_WORDS];
#endif
    while (rayQueryProceedEXT(glint_query)) {
        if (rayQueryGetIntersectionTypeEXT(glint_query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
#ifdef GLINT_USES_FIRST_HIT
            if (glintAskTriangle()) {
                rayQueryConfirmIntersectionEXT(glint_query);
                if (glint_ended) rayQueryTerminateEXT(glint_query);
            }
#else
            rayQueryConfirmIntersectionEXT(glint_query);
#endif
        }
#ifdef GLINT_USES_INTERSECTION
        else {
            float limit = glint_ray_end;
            if (rayQueryGetIntersectionTypeEXT(glint_query, true) != gl_RayQueryCommittedIntersectionNoneEXT)
                limit = rayQueryGetIntersectionTEXT(glint_query, true);
            if (glintAskBox(limit)) {
                box_kind = glint_reported_kind;
                for (int i = 0; i < GLINT_ATTRIBUTE_WORDS; i++) box_attributes[i] = glint_reported_attributes[i];
                rayQueryGenerateIntersectionEXT(glint_query, glint_t_max);
                if (glint_ended) rayQueryTerminateEXT(glint_query);
            }
        }
#endif
    }
    const uint type = rayQueryGetIntersectionTypeEXT(glint_query, true);
    hits = type != gl_RayQueryCommittedIntersectionNoneEXT;
    if (!hits) {
        glint_t_max = glint_ray_end;
        return GLINT_NO_RECORD;
    }
    glint_t_max = rayQueryGetIntersectionTEXT(glint_query, true);
#ifdef GLINT_USES_INTERSECTION
    if (type == gl_RayQueryCommittedIntersectionGeneratedEXT) {
        for (int i = 0; i < GLINT_ATTRIBUTE_WORDS; i++) glint_attributes[i] = box_attributes[i];
        glint_hit_kind = box_kind;
    } else
#endif
    {
        const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(glint_query, true);
        glint_attributes[0] = floatBitsToUint(barycentrics.x);
        glint_attributes[1] = floatBitsToUint(barycentrics.y);
        glint_hit_kind = rayQueryGetIntersectionFrontFaceEXT(glint_query, true) ? 0xfeu : 0xffu;
    }
    uint group;
    GLINT_TELL(true, group);
    return group;
}
