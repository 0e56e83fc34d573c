// A walk through a piece of a graph by one workgroup: #include <glint/meshes/walk.h>, in a compute or task shader. To be
// defined before:
//
//     MESH_GROUP         threads of the workgroup (local_size_x)
//     MESH_PIECE         MeshGraphModel::piece_clusters
//     MESH_SET           of the buffers, and the first of their four consecutive bindings, which are
//     MESH_BINDING       MeshGraphModel's getClusters(), getGroups(), getWalk(), getPieces()
//
// and, before or after, what happens to a cluster that is to be drawn:
//
//     void drawCluster(uint index, MeshCluster cluster) { ... }
#pragma once

#include <glint/meshes/graph.h>

layout(std430, set = MESH_SET, binding = MESH_BINDING) readonly buffer MeshClusters { MeshCluster mesh_clusters[]; };
layout(std430, set = MESH_SET, binding = MESH_BINDING + 1) readonly buffer MeshGroups { MeshClusterGroup mesh_groups[]; };
layout(std430, set = MESH_SET, binding = MESH_BINDING + 2) readonly buffer MeshWalk { uvec2 mesh_walk[]; };
layout(std430, set = MESH_SET, binding = MESH_BINDING + 3) readonly buffer MeshPieces { MeshPiece mesh_pieces[]; };

#define MESH_CULL_FRUSTUM 1u
#define MESH_CULL_CONE 2u

// Clusters to come by. No more than a piece has, as each comes here once: those that have been here leave as much room
// at its end.
shared uint mesh_stack[MESH_PIECE];
shared uint mesh_stack_size;
// What was left out: groups and clusters, and clusters.
shared uint mesh_outside, mesh_facing_away;

void drawCluster(uint index, MeshCluster cluster);

void visitCluster(uint index, MeshGraphView view, MeshFrustum frustum, float pixels, uint cull) {
    const MeshCluster cluster = mesh_clusters[index];
    const bool in_frustum = (cull & MESH_CULL_FRUSTUM) != 0u;
    if (cluster.source != MESH_NONE) {
        const MeshClusterGroup group = mesh_groups[cluster.source];
        // Its ball holds the cluster, too.
        if (in_frustum && isOutside(frustum, group.center, group.radius)) {
            atomicAdd(mesh_outside, 1u);
            return;
        }
        if (isRefined(view, group, pixels)) {
            const uvec2 below = mesh_walk[index];
            if (below.y == 0u) return;
            const uint place = atomicAdd(mesh_stack_size, below.y);
            for (uint i = 0u; i < below.y; i++) mesh_stack[place + i] = below.x + i;
            return;
        }
    }
    if (in_frustum && isOutside(frustum, cluster.box_min, cluster.box_max)) {
        atomicAdd(mesh_outside, 1u);
        return;
    }
    if ((cull & MESH_CULL_CONE) != 0u && isFacingAway(view, cluster)) {
        atomicAdd(mesh_facing_away, 1u);
        return;
    }
    drawCluster(index, cluster);
}

// To be called by all threads of the group, with the same arguments; ends with a barrier.
void walkMesh(uint piece_index, MeshGraphView view, MeshFrustum frustum, float pixels, uint cull) {
    const MeshPiece piece = mesh_pieces[piece_index];
    bool is_seen = true;
    if (piece.group != MESH_NONE) {
        const MeshClusterGroup group = mesh_groups[piece.group];
        is_seen = isRefined(view, group, pixels) &&
                  ((cull & MESH_CULL_FRUSTUM) == 0u || !isOutside(frustum, group.center, group.radius));
    }
    if (gl_LocalInvocationIndex == 0u) {
        mesh_stack_size = is_seen ? piece.cluster_count : 0u;
        mesh_outside = 0u;
        mesh_facing_away = 0u;
    }
    for (uint i = gl_LocalInvocationIndex; i < piece.cluster_count; i += MESH_GROUP)
        mesh_stack[i] = piece.first_cluster + i;
    barrier();
    uint size = mesh_stack_size;
    while (size > 0u) {
        const uint batch = min(size, MESH_GROUP);
        const uint index = gl_LocalInvocationIndex < batch ? mesh_stack[size - batch + gl_LocalInvocationIndex] : MESH_NONE;
        barrier();
        if (gl_LocalInvocationIndex == 0u) mesh_stack_size = size - batch;
        barrier();
        if (index != MESH_NONE) visitCluster(index, view, frustum, pixels, cull);
        barrier();
        size = mesh_stack_size;
    }
}
