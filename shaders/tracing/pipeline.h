// What the stages of a ray-tracing pipeline share when they run as one compute shader: the frame, by which they hand on
// what Vulkan hands on between shaders, and the records of the binding table. core/shader/traversal_skeleton.cpp writes
// what calls the stages, one glintTrace function a level of recursion, after this; core/shader/traversal_joiner.cpp
// copies the frame to the variables of a stage before it runs.
//
// Before it are defined: GLINT_JOIN_SET, the set of the two blocks; GLINT_PAYLOAD_WORDS, GLINT_CALLABLE_WORDS,
// GLINT_ATTRIBUTE_WORDS and GLINT_PUSH_WORDS, lengths of at least 1, the attributes' of at least 2; and GLINT_USES_...
// for what costs time to know.
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

// Finds a record: sets glint_record and returns its group, GLINT_NO_RECORD if the table has no such record.
uint glintFindRecord(const uint table, const uint index) {
    if (index >= glint_records.words[4u * table + 2u]) return GLINT_NO_RECORD;
    const uint word = glint_records.words[4u * table] + index * glint_records.words[4u * table + 1u];
    glint_record = word + 1u;
    return glint_records.words[word];
}

// Puts what an intersection is like into the frame, all but its distance and kind; returns the group of its record.
uint glintTell(rayQueryEXT query, const bool committed, const uint offset, const uint stride) {
    // Which intersection is meant has to be a constant.
    uint record;
    if (committed) {
        glint_primitive = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
        glint_instance = rayQueryGetIntersectionInstanceIdEXT(query, true);
        glint_geometry = rayQueryGetIntersectionGeometryIndexEXT(query, true);
        record = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(query, true);
#ifdef GLINT_USES_CUSTOM_INDEX
        glint_custom_index = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
#endif
#ifdef GLINT_USES_OBJECT_RAY
        glint_object_origin = rayQueryGetIntersectionObjectRayOriginEXT(query, true);
        glint_object_direction = rayQueryGetIntersectionObjectRayDirectionEXT(query, true);
#endif
#ifdef GLINT_USES_TO_WORLD
        glint_to_world = rayQueryGetIntersectionObjectToWorldEXT(query, true);
#endif
#ifdef GLINT_USES_TO_OBJECT
        glint_to_object = rayQueryGetIntersectionWorldToObjectEXT(query, true);
#endif
    } else {
        glint_primitive = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        glint_instance = rayQueryGetIntersectionInstanceIdEXT(query, false);
        glint_geometry = rayQueryGetIntersectionGeometryIndexEXT(query, false);
        record = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(query, false);
#ifdef GLINT_USES_CUSTOM_INDEX
        glint_custom_index = rayQueryGetIntersectionInstanceCustomIndexEXT(query, false);
#endif
#ifdef GLINT_USES_OBJECT_RAY
        glint_object_origin = rayQueryGetIntersectionObjectRayOriginEXT(query, false);
        glint_object_direction = rayQueryGetIntersectionObjectRayDirectionEXT(query, false);
#endif
#ifdef GLINT_USES_TO_WORLD
        glint_to_world = rayQueryGetIntersectionObjectToWorldEXT(query, false);
#endif
#ifdef GLINT_USES_TO_OBJECT
        glint_to_object = rayQueryGetIntersectionWorldToObjectEXT(query, false);
#endif
    }
    return glintFindRecord(GLINT_TABLE_HIT, record + uint(glint_geometry) * (stride & 15u) + (offset & 15u));
}

// What traceRayEXT begins with, its query apart.
void glintBeginRay(const uint flags, const uint mask, const vec3 origin, const float t_min, const vec3 direction) {
    glint_ray_flags = flags;
    glint_cull_mask = mask & 0xffu;
    glint_world_origin = origin;
    glint_world_direction = direction;
    glint_t_min = t_min;
}

// The stages' calls are written by traversal_skeleton.cpp.
void glintRunFirstHit(const uint group);
void glintRunIntersection(const uint group);

// A triangle that is no opaque one: true if it is there.
bool glintAskTriangle(rayQueryEXT query, const uint offset, const uint stride) {
    const uint group = glintTell(query, false, offset, stride);
    const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, false);
    glint_attributes[0] = floatBitsToUint(barycentrics.x);
    glint_attributes[1] = floatBitsToUint(barycentrics.y);
    glint_t_max = rayQueryGetIntersectionTEXT(query, false);
    glint_hit_kind = rayQueryGetIntersectionFrontFaceEXT(query, false) ? 0xfeu : 0xffu;
    glint_ignored = false;
    glint_ended = false;
    glint_unwind = false;
    glintRunFirstHit(group);
    return !glint_ignored;
}

// A box whose content ends before `limit`, as far as is known: true if its intersection shader has reported a hit that
// is taken; glint_t_max is its distance.
bool glintAskBox(rayQueryEXT query, const float limit, const uint offset, const uint stride) {
    glint_group = glintTell(query, false, offset, stride);
    glint_opaque = rayQueryGetIntersectionCandidateAABBOpaqueEXT(query);
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

// A ray's search, by the query that is at its beginning. Afterwards the frame tells the closest hit; returns the group
// of its record, or GLINT_NO_RECORD. `hits` says whether there is one at all.
uint glintSearch(rayQueryEXT query, const float t_max, const uint offset, const uint stride, out bool hits) {
    uint box_kind = 0u;
    uint box_attributes[GLINT_ATTRIBUTE_WORDS];
    while (rayQueryProceedEXT(query)) {
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
#ifdef GLINT_USES_FIRST_HIT
            if (glintAskTriangle(query, offset, stride)) {
                rayQueryConfirmIntersectionEXT(query);
                if (glint_ended) rayQueryTerminateEXT(query);
            }
#else
            rayQueryConfirmIntersectionEXT(query);
#endif
        }
#ifdef GLINT_USES_INTERSECTION
        else {
            float limit = t_max;
            if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT)
                limit = rayQueryGetIntersectionTEXT(query, true);
            if (glintAskBox(query, limit, offset, stride)) {
                box_kind = glint_reported_kind;
                for (int i = 0; i < GLINT_ATTRIBUTE_WORDS; i++) box_attributes[i] = glint_reported_attributes[i];
                rayQueryGenerateIntersectionEXT(query, glint_t_max);
                if (glint_ended) rayQueryTerminateEXT(query);
            }
        }
#endif
    }
    const uint type = rayQueryGetIntersectionTypeEXT(query, true);
    hits = type != gl_RayQueryCommittedIntersectionNoneEXT;
    if (!hits) {
        glint_t_max = t_max;
        return GLINT_NO_RECORD;
    }
    glint_t_max = rayQueryGetIntersectionTEXT(query, true);
    if (type == gl_RayQueryCommittedIntersectionTriangleEXT) {
        const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
        glint_attributes[0] = floatBitsToUint(barycentrics.x);
        glint_attributes[1] = floatBitsToUint(barycentrics.y);
        glint_hit_kind = rayQueryGetIntersectionFrontFaceEXT(query, true) ? 0xfeu : 0xffu;
    } else {
        for (int i = 0; i < GLINT_ATTRIBUTE_WORDS; i++) glint_attributes[i] = box_attributes[i];
        glint_hit_kind = box_kind;
    }
    return glintTell(query, true, offset, stride);
}
