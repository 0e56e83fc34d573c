// Graphs of levels of detail as shaders see them: #include <glint/meshes/graph.h>. core/format/mesh_graph.h has the
// same for C++, docs/meshes.md the derivations.
#pragma once

#include <glint/ray.h>

// At most 128 triangles with at most 128 vertices; 80 bytes in std430.
struct MeshCluster {
    vec3 center;  // of a ball around its vertices
    float radius;
    vec3 cone_axis;
    float cone_cutoff;
    vec3 box_min;
    uint first_vertex;  // of the vertices of clusters
    vec3 box_max;
    uint first_triangle;  // of the triangles of clusters
    uint counts;          // of vertices, and of triangles << 16
    uint part;
    uint source;  // the group that it simplifies; MESH_NONE: the mesh as it was
    uint group;   // the group that it is simplified with; MESH_NONE: a root
};

// 64 bytes in std430.
struct MeshClusterGroup {
    vec3 center;  // of a ball around all that the parents stand for
    float radius;
    vec3 box_min;
    float error;
    vec3 box_max;
    uint level;
    uint first_child;  // of the clusters
    uint child_count;
    uint first_parent;  // of the parents
    uint parent_count;
};

// What one workgroup walks; 16 bytes in std430.
struct MeshPiece {
    uint group;          // that has to be refined; MESH_NONE: none, always
    uint first_cluster;  // where the walk begins
    uint cluster_count;
    uint reserved;
};

#define MESH_NONE 0xffffffffu
// 2^-16 to 2^-20: bounds of roundings that add up.
#define MESH_ROUNDING_16 1.52587890625e-5
#define MESH_ROUNDING_17 7.62939453125e-6
#define MESH_ROUNDING_18 3.814697265625e-6
#define MESH_ROUNDING_19 1.9073486328125e-6
#define MESH_ROUNDING_20 9.5367431640625e-7

// From where an instance is seen, in the mesh's own space. 48 bytes in std430: what C++ has, and the doubt.
struct MeshGraphView {
    vec3 eye;
    float scale;
    vec3 forward;
    float stretch;
    float slant;
    float near;
    float doubt;  // how far the eye may be from where it is; counts as if all balls were larger
};

// The planes through which an instance is seen, in the mesh's own space: dot(xyz, p) + w of a point within is not
// negative. Left, right, bottom, top, near; of unit length.
struct MeshFrustum {
    vec4 planes[5];
};

uint clusterVertexCount(MeshCluster cluster) { return cluster.counts & 0xffffu; }
uint clusterTriangleCount(MeshCluster cluster) { return cluster.counts >> 16; }
// Corners of a triangle of a cluster, counted within it.
uvec3 clusterCorners(uint packed) { return uvec3(packed, packed >> 10, packed >> 20) & 0x3ffu; }

// Three rows, object to world, as instances hold them; columns as GLSL has them.
mat4x3 meshTransform(vec4 row0, vec4 row1, vec4 row2) { return transpose(mat3x4(row0, row1, row2)); }

float meshLargest(mat4x3 to_world) {
    return max(glintLargest(abs(to_world[0])), max(glintLargest(abs(to_world[1])), glintLargest(abs(to_world[2]))));
}

// False for transforms of instances that are not drawn: NaN or infinite, or with a largest number in the left 3x3 that
// is not within 2^-60 and 2^60.
bool isMeshTransform(mat4x3 to_world) {
    // By their bits: compilers may take for granted that there is no NaN.
    uint bits = 0u;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) bits = max(bits, floatBitsToUint(to_world[i][k]) & 0x7fffffffu);
    const uint linear = floatBitsToUint(meshLargest(to_world));
    return bits < 0x7f800000u && linear >= 0x21800000u && linear <= 0x5d800000u;
}

// The smallest and the largest stretch of the left 3x3, by Jacobi's rotations of its columns, which keep small ones as
// exact as large ones: bounds, the first from below, the second from above.
vec2 meshStretches(vec3 a, vec3 b, vec3 c) {
    vec3 columns[3] = vec3[3](a, b, c);
    float skew = 0.0;  // of the columns that are least at right angles: sine of the angle to one
    for (int sweep = 0; sweep < 6; sweep++) {
        skew = 0.0;
        for (int pair = 0; pair < 3; pair++) {
            const int p = pair == 2 ? 1 : 0, q = pair == 0 ? 1 : 2;
            const float gamma = dot(columns[p], columns[q]);
            const float alpha = dot(columns[p], columns[p]), beta = dot(columns[q], columns[q]);
            const float product = sqrt(alpha) * sqrt(beta);
            if (!(abs(gamma) > 2e-7 * product)) continue;
            skew = max(skew, abs(gamma) / product);
            const float zeta = (beta - alpha) / (2.0 * gamma);
            const float t = (zeta < 0.0 ? -1.0 : 1.0) / (abs(zeta) + sqrt(1.0 + zeta * zeta));
            const float cosine = inversesqrt(1.0 + t * t), sine = cosine * t;
            const vec3 turned = cosine * columns[p] - sine * columns[q];
            columns[q] = sine * columns[p] + cosine * columns[q];
            columns[p] = turned;
        }
        if (skew < 1e-6) break;
    }
    const vec3 lengths = vec3(length(columns[0]), length(columns[1]), length(columns[2]));
    const float high = glintLargest(lengths), low = min(lengths.x, min(lengths.y, lengths.z));
    // Twelve rotations of a column, each rounded by less than 2^-21 of it; the last ones may have left a skew.
    const float doubt = high * MESH_ROUNDING_17;
    return vec2(low * (1.0 - 2.0 * skew) - doubt, high * (1.0 + 2.0 * skew) + doubt);
}

// The view of an instance that isMeshTransform allows, through a pinhole camera (CameraParameters) with a picture of
// this size in pixels. One that has no inverse, or hardly, sees errors as infinite: all of its groups are refined.
MeshGraphView meshGraphView(mat4 projection, mat4 inverse_view, vec3 position, vec2 size, mat4x3 to_world) {
    MeshGraphView view;
    const vec3 axis = -inverse_view[2].xyz;
    const vec2 corner = 1.0 / vec2(projection[0][0], projection[1][1]);
    const float corner_slant = sqrt(1.0 + dot(corner, corner));
    const vec2 focal = abs(vec2(projection[0][0], projection[1][1])) * size * 0.5;

    // In units of its largest number, so that nothing overflows.
    const float power = glintPower(meshLargest(to_world));
    const float inverse_power = 1.0 / power;
    precise mat4x3 unit = mat4x3(to_world[0] * inverse_power, to_world[1] * inverse_power, to_world[2] * inverse_power, vec3(0.0));
    const vec2 stretches = meshStretches(unit[0], unit[1], unit[2]);
    const float determinant = glintDeterminant(unit);
    precise vec3 offset = position - to_world[3];
    view.forward = vec3(glintDot(to_world[0], axis), glintDot(to_world[1], axis), glintDot(to_world[2], axis));
    if (!(stretches.x > MESH_ROUNDING_16 * stretches.y) || determinant == 0.0) {
        view.eye = vec3(0.0);
        view.scale = view.stretch = view.slant = view.near = 0.0;
        view.forward = vec3(0.0);
        view.doubt = 1e30;
        return view;
    }
    precise vec3 far = offset * inverse_power;
    view.eye = vec3(glintDot(glintCross(unit[1], unit[2]), far), glintDot(glintCross(unit[2], unit[0]), far),
                    glintDot(glintCross(unit[0], unit[1]), far)) / determinant;
    // Bounds are rounded up, and what they are divided by down.
    const float up = 1.0 + MESH_ROUNDING_18;
    view.scale = max(focal.x, focal.y) * corner_slant * stretches.y * power * up;
    view.stretch = length(view.forward) * up;
    view.slant = stretches.x * power / (corner_slant * up);
    view.near = projection[3][2];
    view.doubt = MESH_ROUNDING_20 * length(far) / stretches.x * (stretches.y / stretches.x);
    return view;
}

// Bound of a group's error in pixels, wherever it is in the picture, as MeshGraphView::error of C++:
//
//     error * scale / max(dot(forward, v) - stretch * r, slant * (length(v) - r), near),  v = center - eye
//
// with r = radius + doubt. A group that contains another has at least that group's value, rounding included.
float groupError(MeshGraphView view, MeshClusterGroup group) {
    if (group.error == 0.0) return 0.0;
    precise vec3 v = group.center - view.eye;
    precise float radius = group.radius + view.doubt;
    precise float along = glintDot(view.forward, v) - view.stretch * radius;
    precise float across = view.slant * (length(v) - radius);
    const float depth = max(max(along, across), view.near);
    precise float error = group.error * view.scale / depth;
    return depth > 0.0 ? error : uintBitsToFloat(0x7f800000u);
}

// Whether a group has to be drawn by what it was before it was simplified.
bool isRefined(MeshGraphView view, MeshClusterGroup group, float pixels) { return !(groupError(view, group) <= pixels); }

// The rule of a cut: a cluster is drawn if its source (none: false) is not refined, and its group (none: true) is.
bool isDrawn(bool source_refined, bool group_refined) { return !source_refined && group_refined; }

// True only if all triangles of the cluster are clockwise, or edge-on, seen from the eye (in the mesh's own space).
bool isFacingAway(MeshGraphView view, MeshCluster cluster) {
    precise vec3 v = cluster.center - view.eye;
    const float far = length(v) + view.doubt;
    return glintDot(v, cluster.cone_axis) - view.doubt >= (cluster.cone_cutoff + MESH_ROUNDING_19) * far + cluster.radius;
}

// What of an instance a camera sees, in the mesh's own space.
MeshFrustum meshFrustum(mat4 projection, mat4 inverse_view, vec3 position, mat4x3 to_world) {
    precise vec3 offset = position - to_world[3];
    // Rounding of the offset, and of the transforms that the vertices will go through.
    const float doubt = MESH_ROUNDING_20 * (length(offset) + length(position));
    vec3 normals[5] = vec3[5](vec3(projection[0][0], 0.0, projection[2][0] - 1.0),
                              vec3(-projection[0][0], 0.0, -projection[2][0] - 1.0),
                              vec3(0.0, projection[1][1], projection[2][1] - 1.0),
                              vec3(0.0, -projection[1][1], -projection[2][1] - 1.0), vec3(0.0, 0.0, -1.0));
    MeshFrustum frustum;
    for (int i = 0; i < 5; i++) {
        const vec3 normal = normalize(mat3(inverse_view) * normals[i]);
        const vec3 inner = vec3(glintDot(to_world[0], normal), glintDot(to_world[1], normal), glintDot(to_world[2], normal));
        const float distance = doubt - glintDot(normal, offset) - (i == 4 ? projection[3][2] * (1.0 - MESH_ROUNDING_20) : 0.0);
        frustum.planes[i] = vec4(inner, distance);
        const float size = length(inner);
        // Flat ones may have no such plane: nothing is outside of it.
        frustum.planes[i] = size > 0.0 ? vec4(inner, distance) / size : vec4(0.0, 0.0, 0.0, 1e30);
    }
    return frustum;
}

// True only if no point of the ball, or of the box, is within.
bool isOutside(MeshFrustum frustum, vec3 center, float radius) {
    const float slack = radius + MESH_ROUNDING_20 * (abs(center.x) + abs(center.y) + abs(center.z));
    for (int i = 0; i < 5; i++)
        if (glintDot(frustum.planes[i].xyz, center) + frustum.planes[i].w < -slack) return true;
    return false;
}
bool isOutside(MeshFrustum frustum, vec3 box_min, vec3 box_max) {
    const vec3 size = max(abs(box_min), abs(box_max));
    const float slack = MESH_ROUNDING_20 * (size.x + size.y + size.z);
    for (int i = 0; i < 5; i++) {
        const vec3 normal = frustum.planes[i].xyz;
        const vec3 inmost = mix(box_min, box_max, greaterThan(normal, vec3(0.0)));
        if (glintDot(normal, inmost) + frustum.planes[i].w < -slack) return true;
    }
    return false;
}
