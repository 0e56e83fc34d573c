// The interface between shaders with ray queries and the traversal of Glint's own tracing engine.
//
// A library is a file that includes this one, declares the engine's buffers in set GLINT_TRACING_SET, which is hidden
// from users, and defines
//
//     struct GlintRayQuery { ... };   // one query: all of its state; the library has no other
//
// and the functions below. Shaders rewritten for the software engine call them in the place of rayQuery*EXT, with the
// same meaning (GL_EXT_ray_query): `committed` chooses between the committed and the candidate intersection, and what
// GLSL leaves undefined may be any value, but never a crash or an endless loop for queries that were initialised. The
// query is always `inout`, although most functions only read it, so that a call passes a place and no copy; all else is
// `const`. Queries may be variables of a function or of the module: a function passes its query to none of its own.
// Where a rewritten shader runs is not known: no built-in variables, no barriers, no derivatives.
//
//     void  glintRayQueryInitialize(inout GlintRayQuery query, const GlintTracing tracing, const uint flags,
//                                   const uint mask, const vec3 origin, const float tmin, const vec3 direction,
//                                   const float tmax)
//     bool  glintRayQueryProceed(inout GlintRayQuery query)
//     void  glintRayQueryTerminate(inout GlintRayQuery query)
//     void  glintRayQueryConfirmIntersection(inout GlintRayQuery query)
//     void  glintRayQueryGenerateIntersection(inout GlintRayQuery query, const float t)
//     float glintRayQueryGetRayTMin(inout GlintRayQuery query)
//     uint  glintRayQueryGetRayFlags(inout GlintRayQuery query)
//     vec3  glintRayQueryGetWorldRayOrigin(inout GlintRayQuery query)
//     vec3  glintRayQueryGetWorldRayDirection(inout GlintRayQuery query)
//     bool  glintRayQueryGetIntersectionCandidateAABBOpaque(inout GlintRayQuery query)
//
// and with (inout GlintRayQuery query, const bool committed), named glintRayQueryGetIntersection... each:
//
//     uint  ...Type                    int   ...InstanceCustomIndex      vec3   ...ObjectRayOrigin
//     float ...T                       int   ...InstanceId               vec3   ...ObjectRayDirection
//     vec2  ...Barycentrics            int   ...GeometryIndex            mat4x3 ...ObjectToWorld
//     bool  ...FrontFace               int   ...PrimitiveIndex           mat4x3 ...WorldToObject
//     uint  ...InstanceShaderBindingTableRecordOffset
#pragma once

// What names an acceleration structure: the 64 bits that the engine gives out as its address, low word first. The
// software engine's descriptor of a structure is a block of them, 16 bytes apart.
#define GlintTracing uvec2

// Ray flags, as in GLSL.
#define GLINT_RAY_OPAQUE 1u
#define GLINT_RAY_NO_OPAQUE 2u
#define GLINT_RAY_TERMINATE_ON_FIRST_HIT 4u
#define GLINT_RAY_CULL_BACK 16u
#define GLINT_RAY_CULL_FRONT 32u
#define GLINT_RAY_CULL_OPAQUE 64u
#define GLINT_RAY_CULL_NO_OPAQUE 128u
#define GLINT_RAY_SKIP_TRIANGLES 256u
#define GLINT_RAY_SKIP_BOXES 512u

// Instance flags: those of Tracing::InstanceFlag, in the same order.
#define GLINT_INSTANCE_CULL_DISABLE 1u
#define GLINT_INSTANCE_FLIP_FACING 2u
#define GLINT_INSTANCE_OPAQUE 4u
#define GLINT_INSTANCE_TRANSPARENT 8u

// What rayQueryGetIntersectionTypeEXT says of a committed intersection and of a candidate.
#define GLINT_COMMITTED_NONE 0u
#define GLINT_COMMITTED_TRIANGLE 1u
#define GLINT_COMMITTED_GENERATED 2u
#define GLINT_CANDIDATE_TRIANGLE 0u
#define GLINT_CANDIDATE_BOX 1u
