#if TASK_SHADER
    // Declares the four buffers of the graph at the bindings from 2 on.
    #define MESH_SET 0
    #define MESH_BINDING 2
    #include <glint/meshes/walk.h>
#elif !ID_SHADER
    #include <glint/meshes/graph.h>
#endif

#if TASK_SHADER || MESH_SHADER || VERTEX_SHADER || FRAGMENT_SHADER

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    vec2 size;
    float split;
    float pixels;
    uint cull;
    uint has_instance_color;
    uvec2 reserved;
};

#endif

#if TASK_SHADER || MESH_SHADER || VERTEX_SHADER

// Three rows of each transform.
layout(std430, set = 0, binding = 1) readonly buffer Instances { vec4 rows[]; };

mat4x3 toWorld(uint instance) { return meshTransform(rows[instance * 3u], rows[instance * 3u + 1u], rows[instance * 3u + 2u]); }

#endif

#if TASK_SHADER || MESH_SHADER

struct Payload {
    uint instance;
    uint clusters[MESH_PIECE];
};
taskPayloadSharedEXT Payload payload;

layout(local_size_x = MESH_GROUP) in;

#endif

#if TASK_SHADER

layout(std430, set = 0, binding = 10) buffer Counts {
    uint clusters, wanted;
    uint triangles, triangles_high;
    uint outside, facing_away;
} counts;

shared uint cluster_count, triangle_count;

void drawCluster(uint index, MeshCluster cluster) {
    payload.clusters[atomicAdd(cluster_count, 1u)] = index;
    atomicAdd(triangle_count, clusterTriangleCount(cluster));
}

/// Walks a piece of the graph for an instance, and starts a group of the mesh shader for each cluster to be drawn.
void main() {
    const uint instance = gl_WorkGroupID.x;
    const mat4x3 to_world = toWorld(instance);
    if (gl_LocalInvocationIndex == 0u) {
        payload.instance = instance;
        cluster_count = 0u;
        triangle_count = 0u;
    }
    const MeshGraphView view =
        meshGraphView(camera.projection, camera.inverse_view, camera.position.xyz, size, to_world);
    const MeshFrustum frustum = meshFrustum(camera.projection, camera.inverse_view, camera.position.xyz, to_world);
    walkMesh(gl_WorkGroupID.y, view, frustum, pixels, cull);

    if (gl_LocalInvocationIndex == 0u) {
        if (cluster_count > 0u) {
            atomicAdd(counts.clusters, cluster_count);
            const uint before = atomicAdd(counts.triangles, triangle_count);
            if (before + triangle_count < before) atomicAdd(counts.triangles_high, 1u);
        }
        if (mesh_outside > 0u) atomicAdd(counts.outside, mesh_outside);
        if (mesh_facing_away > 0u) atomicAdd(counts.facing_away, mesh_facing_away);
    }
    EmitMeshTasksEXT(cluster_count, 1, 1);
}

#endif

#if MESH_SHADER || VERTEX_SHADER

layout(std430, set = 0, binding = 2) readonly buffer MeshClusters { MeshCluster mesh_clusters[]; };
layout(std430, set = 0, binding = 6) readonly buffer Positions { float positions[]; };
layout(std430, set = 0, binding = 7) readonly buffer Normals { float normals[]; };
layout(std430, set = 0, binding = 8) readonly buffer ClusterVertices { uint cluster_vertices[]; };

/// Of a vertex: where it is in clip space, and its normal in the world, of any length.
vec4 clipPosition(uint vertex, mat4x3 to_world) {
    const vec3 position = vec3(positions[vertex * 3u], positions[vertex * 3u + 1u], positions[vertex * 3u + 2u]);
    // The same bits in every shader.
    precise const vec3 place = to_world * vec4(position, 1.0);
    precise const vec4 clip = camera.projection * (camera.view * vec4(place, 1.0));
    return clip;
}

vec3 worldNormal(uint vertex, mat4x3 to_world) {
    const vec3 normal = vec3(normals[vertex * 3u], normals[vertex * 3u + 1u], normals[vertex * 3u + 2u]);
    // By cofactors: right for any transform that is no mirror.
    precise const vec3 result = cross(to_world[1], to_world[2]) * normal.x + cross(to_world[2], to_world[0]) * normal.y +
                                cross(to_world[0], to_world[1]) * normal.z;
    return result;
}

#endif

#if MESH_SHADER

layout(triangles, max_vertices = 128, max_primitives = 128) out;

layout(std430, set = 0, binding = 9) readonly buffer ClusterTriangles { uint cluster_triangles[]; };

layout(location = 0) out vec3 out_normal[];
layout(location = 1) flat out uvec2 out_source[];

void main() {
    const uint index = payload.clusters[gl_WorkGroupID.x];
    const MeshCluster cluster = mesh_clusters[index];
    const uint vertex_count = clusterVertexCount(cluster), triangle_count = clusterTriangleCount(cluster);
    SetMeshOutputsEXT(vertex_count, triangle_count);
    const mat4x3 to_world = toWorld(payload.instance);
    for (uint i = gl_LocalInvocationIndex; i < vertex_count; i += MESH_GROUP) {
        const uint vertex = cluster_vertices[cluster.first_vertex + i];
        gl_MeshVerticesEXT[i].gl_Position = clipPosition(vertex, to_world);
        out_normal[i] = worldNormal(vertex, to_world);
        out_source[i] = uvec2(payload.instance, index);
    }
    for (uint i = gl_LocalInvocationIndex; i < triangle_count; i += MESH_GROUP)
        gl_PrimitiveTriangleIndicesEXT[i] = clusterCorners(cluster_triangles[cluster.first_triangle + i]);
}

#elif VERTEX_SHADER

layout(std430, set = 0, binding = 11) readonly buffer List { uvec2 list[]; };

layout(location = 0) out vec3 out_normal;
layout(location = 1) flat out uvec2 out_source;

/// A draw for each entry of the list: its number is the draw's first instance.
void main() {
    const uvec2 entry = list[gl_InstanceIndex];
    const uint vertex = cluster_vertices[mesh_clusters[entry.y].first_vertex + gl_VertexIndex];
    const mat4x3 to_world = toWorld(entry.x);
    gl_Position = clipPosition(vertex, to_world);
    out_normal = worldNormal(vertex, to_world);
    out_source = entry;
}

#elif FRAGMENT_SHADER

layout(location = 0) in vec3 in_normal;
layout(location = 1) flat in uvec2 in_source;

layout(location = 0) out vec4 out_color;
#if INSTANCE_IDS
layout(location = 1) out uint out_id;
#endif

vec3 sourceColor(uint source) {
    const float x = float(source * 157u & 255u) / 256.0;
    return 0.6 + 0.4 * cos(6.2831853 * (x + vec3(0.0, 0.33, 0.67)));
}

void main() {
    const vec2 place = gl_FragCoord.xy / size;
    const vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);
    // Phong, with the light at the eye: the reflection's angle to the eye is twice the normal's.
    const float diffuse = max(-dot(normalize(in_normal), direction), 0.0);
    const float specular = pow(max(2.0 * diffuse * diffuse - 1.0, 0.0), 16.0);
    vec3 color = vec3(0.75);
    if (gl_FragCoord.x > size.x * split) color = sourceColor(has_instance_color != 0u ? in_source.x : in_source.y);
    out_color = vec4(color * diffuse + 0.25 * specular, 1.0);
#if INSTANCE_IDS
    out_id = ~in_source.x;
#endif
}

#elif ARGUMENT_SHADER

layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer MeshClusters { MeshCluster mesh_clusters[]; };
layout(std430, set = 0, binding = 1) readonly buffer List { uvec2 list[]; };
layout(std430, set = 0, binding = 2) readonly buffer Count { uint entries; };
layout(std430, set = 0, binding = 3) writeonly buffer Arguments { uint arguments[]; };

/// Entries of the list to draws of as many indices.
void main() {
    for (uint i = gl_GlobalInvocationID.x; i < entries; i += gl_NumWorkGroups.x * 64u) {
        const MeshCluster cluster = mesh_clusters[list[i].y];
        arguments[i * 5u] = clusterTriangleCount(cluster) * 3u;
        arguments[i * 5u + 1u] = 1u;
        arguments[i * 5u + 2u] = cluster.first_triangle * 3u;
        arguments[i * 5u + 3u] = 0u;
        arguments[i * 5u + 4u] = i;
    }
}

#elif ID_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0) uniform utexture2D picture;
layout(std430, set = 0, binding = 1) writeonly buffer Ids { uint ids[]; };

void main() {
    const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = textureSize(picture, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    // The picture holds the complement, so that what was cleared to 0 is no instance.
    ids[pixel.y * size.x + pixel.x] = ~texelFetch(picture, pixel, 0).x;
}

#endif
