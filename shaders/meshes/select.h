// What of many instances of a graph is to be drawn: a workgroup for each piece of each instance.
// MESH_GROUP: its threads.
#pragma once

#define MESH_SET 0
#define MESH_BINDING 2
#include <glint/meshes/walk.h>

layout(local_size_x = MESH_GROUP) in;

layout(std140, set = 0, binding = 0) uniform Parameters {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
    vec2 size;  // of the picture
    float pixels;
    uint cull;
    uint instances;
    uint pieces;
    uint capacity;  // entries of the list
    uint reserved;
} parameters;

layout(std430, set = 0, binding = 1) readonly buffer Instances { vec4 rows[]; };
layout(std430, set = 0, binding = 6) writeonly buffer List { uvec2 list[]; };
layout(std430, set = 0, binding = 7) buffer Count {
    uint entries;  // in the list
    uint wanted;   // entries without a limit
    uint triangles_low, triangles_high;
    uint outside, facing_away;
    uint refused;
    uint most;  // wanted since the last check
} count;

shared uint found;  // from the end of mesh_stack
shared uint triangles;
shared uint first;

void drawCluster(uint index, MeshCluster cluster) {
    mesh_stack[MESH_PIECE - 1u - atomicAdd(found, 1u)] = index;
    atomicAdd(triangles, clusterTriangleCount(cluster));
}

void main() {
    const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint instance = group / parameters.pieces, piece = group % parameters.pieces;
    if (instance >= parameters.instances) return;
    const mat4x3 to_world = meshTransform(rows[3u * instance], rows[3u * instance + 1u], rows[3u * instance + 2u]);
    if (!isMeshTransform(to_world)) {
        if (piece == 0u && gl_LocalInvocationIndex == 0u) atomicAdd(count.refused, 1u);
        return;
    }
    const MeshGraphView view = meshGraphView(parameters.projection, parameters.inverse_view, parameters.position.xyz,
                                             parameters.size, to_world);
    const MeshFrustum frustum =
        meshFrustum(parameters.projection, parameters.inverse_view, parameters.position.xyz, to_world);
    if (gl_LocalInvocationIndex == 0u) {
        found = 0u;
        triangles = 0u;
    }
    walkMesh(piece, view, frustum, parameters.pixels, parameters.cull);

    if (gl_LocalInvocationIndex == 0u) {
        if (mesh_outside > 0u) atomicAdd(count.outside, mesh_outside);
        if (mesh_facing_away > 0u) atomicAdd(count.facing_away, mesh_facing_away);
        if (found > 0u) {
            // Places are given away without a gap, so what is written fills the list from its beginning.
            first = atomicAdd(count.wanted, found);
            atomicMax(count.most, first + found);
            const uint written = min(first + found, parameters.capacity) - min(first, parameters.capacity);
            if (written > 0u) atomicAdd(count.entries, written);
            const uint before = atomicAdd(count.triangles_low, triangles);
            if (before + triangles < before) atomicAdd(count.triangles_high, 1u);
        }
    }
    barrier();
    for (uint i = gl_LocalInvocationIndex; i < found; i += MESH_GROUP)
        if (first + i < parameters.capacity) list[first + i] = uvec2(instance, mesh_stack[MESH_PIECE - 1u - i]);
}
