// Primary rays, reflections and shadows: with RAYGEN_SHADER and so on the stages of a ray-tracing pipeline, with
// QUERY_SHADER the same by ray queries in a compute shader.

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    vec4 light;
    uvec4 first_vertex;  // of each mesh in the buffers
    uvec4 first_index;
};

// A position and a normal each, of all meshes.
layout(std430, set = 0, binding = 1) readonly buffer Vertices { float vertices[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };

layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;

layout(set = 2, binding = 0, rgba8) uniform writeonly image2D picture;

const uint mesh_model = 0u, mesh_dodecahedron = 1u, mesh_plane = 2u;
const float nearest = 1e-3, farthest = 1000.0;
const vec3 background = vec3(0.2);
const float shaded = 0.2;  // what shadows leave of the light

// Rays choose their hit group by an offset, to which the instance's is added, and their miss shader.
const uint primary_group = 0u, reflection_group = 3u, group_stride = 3u;
const uint primary_miss = 0u, reflection_miss = 1u, shadow_miss = 2u;
const uint shadow_flags =
    gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;

vec3 vertexNormal(uint vertex) {
    const uint at = vertex * 6u + 3u;
    return vec3(vertices[at], vertices[at + 1u], vertices[at + 2u]);
}

/// In the world, from the corners' normals.
vec3 normalAt(uint mesh, uint primitive, vec2 uv, mat4x3 to_object) {
    const uint corner = first_index[mesh] + primitive * 3u;
    const vec3 normal = vertexNormal(first_vertex[mesh] + indices[corner]) * (1.0 - uv.x - uv.y) +
                        vertexNormal(first_vertex[mesh] + indices[corner + 1u]) * uv.x +
                        vertexNormal(first_vertex[mesh] + indices[corner + 2u]) * uv.y;
    // Row vector times the inverse of object-to-world: right for any affine transform.
    return normalize(normal * mat3(to_object));
}

/// The plane has checkers of 2 units.
vec3 meshColor(uint mesh, vec3 position) {
    if (mesh == mesh_model) return vec3(0.80, 0.62, 0.34);
    if (mesh == mesh_dodecahedron) return vec3(0.30, 0.55, 0.85);
    const vec2 cell = floor(position.xy * 0.5);
    return vec3(mod(cell.x + cell.y, 2.0) < 0.5 ? 0.75 : 0.5);
}

/// What the light does on a surface, if nothing is in its way.
vec3 lit(vec3 position, vec3 direction, vec3 normal, vec3 color) {
    const vec3 to_light = normalize(light.xyz - position);
    const float diffuse = max(dot(normal, to_light), 0.0);
    const float specular = pow(max(dot(reflect(direction, normal), to_light), 0.0), 16.0);
    return color * diffuse + 0.5 * specular;
}

vec3 cameraDirection(uvec2 pixel, uvec2 size) {
    const vec2 place = (vec2(pixel) + 0.5) / vec2(size);
    return normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);
}

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT vec3 color;

void main() {
    const vec3 direction = cameraDirection(gl_LaunchIDEXT.xy, gl_LaunchSizeEXT.xy);
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, primary_group, group_stride, primary_miss, camera.position.xyz, 0.0,
                direction, farthest, 0);
    imageStore(picture, ivec2(gl_LaunchIDEXT.xy), vec4(color, 1.0));
}

#elif PRIMARY_MISS_SHADER || REFLECTION_MISS_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

#if PRIMARY_MISS_SHADER
void main() { color = background; }
#else
void main() { color = vec3(0.0); }
#endif

#elif SHADOW_MISS_SHADER

layout(location = 1) rayPayloadInEXT float visible;

void main() { visible = 1.0; }

#elif PRIMARY_SHADER || REFLECTION_SHADER

// Compiled for each mesh: MESH is its number.
layout(location = 0) rayPayloadInEXT vec3 color;
hitAttributeEXT vec2 barycentrics;

#if PRIMARY_SHADER && RECURSION_DEPTH > 1
layout(location = 1) rayPayloadEXT float visible;
layout(location = 2) rayPayloadEXT vec3 reflection;
#endif

void main() {
    const vec3 direction = gl_WorldRayDirectionEXT;
    const vec3 position = gl_WorldRayOriginEXT + direction * gl_HitTEXT;
    const vec3 normal = normalAt(MESH, gl_PrimitiveID, barycentrics, gl_WorldToObjectEXT);
    color = lit(position, direction, normal, meshColor(MESH, position));
#if PRIMARY_SHADER && RECURSION_DEPTH > 1
    visible = shaded;
    traceRayEXT(scene, shadow_flags, 0xff, 0, group_stride, shadow_miss, position, nearest,
                normalize(light.xyz - position), distance(light.xyz, position), 1);
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, reflection_group, group_stride, reflection_miss, position, nearest,
                reflect(direction, normal), farthest, 2);
    color = color * visible + 0.5 * reflection;
#endif
}

#elif QUERY_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

/// What a closest-hit shader of the pipeline gives, but for the rays that it traces; false for a miss.
bool closest(vec3 origin, float t_min, vec3 direction, out vec3 position, out vec3 normal, out vec3 color) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, t_min, direction, farthest);
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return false;
    // An instance's offset into the hit groups is its mesh.
    const uint mesh = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(query, true);
    position = origin + direction * rayQueryGetIntersectionTEXT(query, true);
    normal = normalAt(mesh, uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)),
                      rayQueryGetIntersectionBarycentricsEXT(query, true),
                      rayQueryGetIntersectionWorldToObjectEXT(query, true));
    color = lit(position, direction, normal, meshColor(mesh, position));
    return true;
}

float visibility(vec3 position) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, position,
                          nearest, normalize(light.xyz - position), distance(light.xyz, position));
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT ? 1.0 : shaded;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy, size = uvec2(imageSize(picture));
    if (any(greaterThanEqual(pixel, size))) return;
    const vec3 direction = cameraDirection(pixel, size);
    vec3 position, normal, color;
    if (closest(camera.position.xyz, 0.0, direction, position, normal, color)) {
#if RECURSION_DEPTH > 1
        vec3 unused_position, unused_normal, reflection;
        if (!closest(position, nearest, reflect(direction, normal), unused_position, unused_normal, reflection))
            reflection = vec3(0.0);
        color = color * visibility(position) + 0.5 * reflection;
#endif
    } else {
        color = background;
    }
    imageStore(picture, ivec2(pixel), vec4(color, 1.0));
}

#endif
