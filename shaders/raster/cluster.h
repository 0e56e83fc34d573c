// The triangles of clusters of instances in clip space.
#pragma once

#include <glint/raster/corner.h>

layout(std430, binding = 5) readonly buffer Positions { float positions[]; };
layout(std430, binding = 6) readonly buffer Clusters { uint cluster_words[]; };  // 80 bytes each
layout(std430, binding = 7) readonly buffer ClusterVertices { uint cluster_vertices[]; };
layout(std430, binding = 8) readonly buffer ClusterTriangles { uint cluster_triangles[]; };
layout(std430, binding = 9) readonly buffer Instances { vec4 instance_rows[]; };  // object to world, three each

struct Cluster {
    uint first_vertex, first_triangle;
    uint vertices, triangles;
};

Cluster clusterOf(uint number) {
    const uint counts = cluster_words[20u * number + 16u];
    return Cluster(cluster_words[20u * number + 11u], cluster_words[20u * number + 15u], counts & 0xffffu, counts >> 16);
}

vec4 clusterPosition(Cluster cluster, uint instance, uint vertex) {
    const uint first = 3u * cluster_vertices[cluster.first_vertex + vertex];
    const vec4 p = vec4(positions[first], positions[first + 1u], positions[first + 2u], 1.0);
    const vec4 x = instance_rows[3u * instance], y = instance_rows[3u * instance + 1u],
               z = instance_rows[3u * instance + 2u];
    precise vec3 world = vec3(x.x, y.x, z.x) * p.x +
                         (vec3(x.y, y.y, z.y) * p.y + (vec3(x.z, y.z, z.z) * p.z + vec3(x.w, y.w, z.w)));
    return transformPosition(world);
}

uvec3 clusterCorners(Cluster cluster, uint triangle) {
    const uint packed = cluster_triangles[cluster.first_triangle + triangle];
    return uvec3(packed, packed >> 10, packed >> 20) & 0x3ffu;
}

uint idOf(uint instance, uint cluster, uint triangle) { return (instance * frame.clusters + cluster) * 128u + triangle; }

void trianglePositions(uint id, out vec4 a, out vec4 b, out vec4 c) {
    const uint instance = id / 128u / frame.clusters;
    const Cluster cluster = clusterOf(id / 128u % frame.clusters);
    const uvec3 corners = clusterCorners(cluster, id % 128u);
    a = clusterPosition(cluster, instance, corners.x);
    b = clusterPosition(cluster, instance, corners.y);
    c = clusterPosition(cluster, instance, corners.z);
}
