// The interface between shaders with ray queries and a traversal library of Glint's own.
//
// A library is a file that declares the engine's buffers in set GLINT_TRACING_SET, which is hidden from users, and
// defines
//
//     struct GlintQuery { uint number; ... };   // a query's state
//
// and the functions below. Shaders rewritten for the software engine call them in the place of rayQuery*EXT, with the
// same meaning (GL_EXT_ray_query): `committed` chooses between the committed intersection and the candidate. What GLSL
// leaves undefined may be any value, but no endless loop for queries that were initialised.
//
//     void  glintQueryInitialize(inout GlintQuery query, uint number, uint top, uint flags, uint mask, vec3 origin,
//                                float t_min, vec3 direction, float t_max)
//     bool  glintQueryProceed(inout GlintQuery query)
//     void  glintQueryTerminate(inout GlintQuery query)
//     void  glintQueryConfirm(inout GlintQuery query)
//     void  glintQueryGenerate(inout GlintQuery query, float t)
//     float glintQueryTMin(GlintQuery query)              vec3 glintQueryWorldRayOrigin(GlintQuery query)
//     uint  glintQueryFlags(GlintQuery query)             vec3 glintQueryWorldRayDirection(GlintQuery query)
//     bool  glintQueryCandidateBoxOpaque(GlintQuery query)
//
// and with (GlintQuery query, bool committed)
//
//     uint  glintQueryType            int  glintQueryInstanceId            vec3   glintQueryObjectRayOrigin
//     float glintQueryT               int  glintQueryInstanceCustomIndex   vec3   glintQueryObjectRayDirection
//     vec2  glintQueryBarycentrics    int  glintQueryGeometryIndex         mat4x3 glintQueryObjectToWorld
//     bool  glintQueryFrontFace       int  glintQueryPrimitiveIndex        mat4x3 glintQueryWorldToObject
//     uint  glintQueryInstanceOffset
//
// `top` is what the engine gives out as the structure's address, its low word; with `uvec2 top` both words. Every query
// of a shader has a number of its own below GLINT_TRACING_QUERIES, for state that is better kept in arrays beside the
// structure; it is in `query.number` before the query is initialised.
//
// Calls pass the place of a query, also where a parameter is not declared `inout`: such a function must not write to
// it. Where a rewritten shader runs is not known: no built-in variables, no barriers, no derivatives.
#pragma once

#ifndef GLINT_TRACING_SET
#define GLINT_TRACING_SET 0
#endif
#ifndef GLINT_TRACING_QUERIES
#define GLINT_TRACING_QUERIES 1
#endif

// Flags of rays and instances, kinds of intersections: the numbers of Vulkan.
const uint GLINT_RAY_OPAQUE = 1u;
const uint GLINT_RAY_NO_OPAQUE = 2u;
const uint GLINT_RAY_TERMINATE = 4u;
const uint GLINT_RAY_CULL_BACK = 16u;
const uint GLINT_RAY_CULL_FRONT = 32u;
const uint GLINT_RAY_CULL_OPAQUE = 64u;
const uint GLINT_RAY_CULL_NO_OPAQUE = 128u;
const uint GLINT_RAY_SKIP_TRIANGLES = 256u;
const uint GLINT_RAY_SKIP_BOXES = 512u;
const uint GLINT_INSTANCE_CULL_DISABLE = 1u;
const uint GLINT_INSTANCE_FLIP_FACING = 2u;
const uint GLINT_INSTANCE_OPAQUE = 4u;
const uint GLINT_INSTANCE_NO_OPAQUE = 8u;
const uint GLINT_COMMITTED_NONE = 0u;
const uint GLINT_COMMITTED_TRIANGLE = 1u;
const uint GLINT_COMMITTED_GENERATED = 2u;
const uint GLINT_CANDIDATE_TRIANGLE = 0u;
const uint GLINT_CANDIDATE_BOX = 1u;
