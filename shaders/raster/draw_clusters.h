// Clusters of instances from a list, a group each.
#pragma once

#include <glint/raster/cluster.h>
#include <glint/raster/triangle.h>

layout(local_size_x = GLINT_GROUP) in;

layout(std430, binding = 10) readonly buffer List { uvec2 list[]; };
layout(std430, binding = 11) readonly buffer Count { uint list_count; };

const uint VERTICES = 128u, TRIANGLES = 128u;

shared ivec2 corner_at[VERTICES];
shared float corner_depths[VERTICES];
shared uint corner_flags[VERTICES];

Corner cornerOf(uint i) { return Corner(corner_at[i], corner_depths[i], corner_flags[i]); }

void main() {
    const uint count = min(list_count, frame.entries), local = gl_LocalInvocationIndex;
    for (uint i = groupIndex(); i < count; i += groupCount()) {
        const uvec2 entry = list[i];
        if (entry.x >= frame.instances || entry.y >= frame.clusters) continue;
        const Cluster cluster = clusterOf(entry.y);
        for (uint k = local; k < cluster.vertices; k += GLINT_GROUP) {
            const Corner corner = project(clusterPosition(cluster, entry.x, k));
            corner_at[k] = corner.at;
            corner_depths[k] = corner.depth;
            corner_flags[k] = corner.flags;
        }
        barrier();
        for (uint k = local; k < cluster.triangles; k += GLINT_GROUP) {
            const uvec3 corners = clusterCorners(cluster, k);
            drawTriangle(cornerOf(corners.x), cornerOf(corners.y), cornerOf(corners.z), idOf(entry.x, entry.y, k));
        }
        barrier();
    }
}
