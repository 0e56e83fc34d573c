// What the visibility buffer says of each pixel, shaded.

#include <glint/meshes/graph.h>
#include <glint/raster/visibility.h>

layout(local_size_x = 8, local_size_y = 8) in;

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    uvec2 size;
    float split;
    uint cluster_count;
    uint has_instance_color;  // else each cluster has a colour
};

layout(std430, set = 0, binding = 1) readonly buffer Visibility { uvec2 visibility[]; };
layout(std430, set = 0, binding = 2) readonly buffer Instances { vec4 rows[]; };  // three each
layout(std430, set = 0, binding = 3) readonly buffer Clusters { MeshCluster clusters[]; };
layout(std430, set = 0, binding = 4) readonly buffer ClusterVertices { uint cluster_vertices[]; };
layout(std430, set = 0, binding = 5) readonly buffer ClusterTriangles { uint cluster_triangles[]; };
layout(std430, set = 0, binding = 6) readonly buffer Positions { float positions[]; };
layout(std430, set = 0, binding = 7) readonly buffer Normals { float normals[]; };
#if INSTANCE_IDS
layout(std430, set = 0, binding = 8) writeonly buffer Ids { uint ids[]; };  // of each pixel
#endif

layout(set = 1, binding = 0, rgba8) uniform writeonly image2D picture;

vec4 clipPosition(mat4x3 to_world, uint vertex) {
    vec3 p = vec3(positions[3u * vertex], positions[3u * vertex + 1u], positions[3u * vertex + 2u]);
    return camera.projection * (camera.view * vec4(to_world * vec4(p, 1.0), 1.0));
}

vec3 vertexNormal(uint vertex) {
    return vec3(normals[3u * vertex], normals[3u * vertex + 1u], normals[3u * vertex + 2u]);
}

vec3 sourceColor(uint source) {
    float x = float(source * 157u & 255u) / 256.0;
    return 0.6 + 0.4 * cos(6.2831853 * (x + vec3(0.0, 0.33, 0.67)));
}

vec3 shade(uvec2 pixel, uvec3 seen) {
    uint triangle = cluster_triangles[clusters[seen.y].first_triangle + seen.z];
    uvec3 corners = clusters[seen.y].first_vertex + clusterCorners(triangle);
    uvec3 vertices = uvec3(cluster_vertices[corners.x], cluster_vertices[corners.y], cluster_vertices[corners.z]);

    mat4x3 to_world = meshTransform(rows[3u * seen.x], rows[3u * seen.x + 1u], rows[3u * seen.x + 2u]);
    vec2 place = vec2(pixel) + 0.5;
    vec3 weights = barycentrics(clipPosition(to_world, vertices.x), clipPosition(to_world, vertices.y),
                                clipPosition(to_world, vertices.z), place, vec2(size)).weights;
    vec3 object_normal = vertexNormal(vertices.x) * weights.x + vertexNormal(vertices.y) * weights.y +
                         vertexNormal(vertices.z) * weights.z;
    // By the matrix of cofactors, which is the inverse transpose but for its length: right for any affine transform.
    mat3 turn = mat3(to_world);
    vec3 normal = mat3(cross(turn[1], turn[2]), cross(turn[2], turn[0]), cross(turn[0], turn[1])) * object_normal;
    normal = normalize(determinant(turn) < 0.0 ? -normal : normal);

    // Phong, with the light at the eye: the reflection's angle to the eye is twice the normal's.
    vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * (place.x / float(size.x)) +
                               camera.ray_y.xyz * (place.y / float(size.y)));
    float diffuse = max(-dot(normal, direction), 0.0);
    float specular = pow(max(2.0 * diffuse * diffuse - 1.0, 0.0), 16.0);
    vec3 color = vec3(0.75);
    if (place.x > float(size.x) * split) color = sourceColor(has_instance_color != 0u ? seen.x : seen.y);
    return color * diffuse + 0.25 * specular;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, size))) return;
    uint index = pixel.y * size.x + pixel.x;
    vec3 color = vec3(0.25);
    if (isVisible(visibility[index])) {
        uvec3 seen = visibleCluster(visibility[index], cluster_count);
        color = shade(pixel, seen);
#if INSTANCE_IDS
        ids[index] = seen.x;
#endif
    }
    imageStore(picture, ivec2(pixel), vec4(color, 1.0));
}
