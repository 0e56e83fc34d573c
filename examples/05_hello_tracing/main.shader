#if VERTEX_SHADER

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4(corner * 4.0 - 1.0, 0.0, 1.0);
}

#else

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    vec2 size;
    float split;
};

// A position and a normal each.
layout(std430, set = 0, binding = 1) readonly buffer Vertices { float vertices[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };
#if INSTANCE_IDS
layout(std430, set = 0, binding = 3) writeonly buffer Ids { uint ids[]; };  // of each pixel
#endif

layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;

vec3 vertexNormal(uint corner) {
    uint vertex = indices[corner] * 6u + 3u;
    return vec3(vertices[vertex], vertices[vertex + 1u], vertices[vertex + 2u]);
}

vec3 instanceColor(uint instance) {
    float x = float(instance * 157u & 255u) / 256.0;
    return 0.6 + 0.4 * cos(6.2831853 * (x + vec3(0.0, 0.33, 0.67)));
}

/// False if the ray through the pixel meets nothing.
bool trace(vec2 pixel, out vec3 color) {
    vec2 place = (pixel + 0.5) / size;
    vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);

    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, camera.position.xyz, 0.0, direction, 1000.0);
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return false;

    uint instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
#if INSTANCE_IDS
    ids[uint(pixel.y) * uint(size.x) + uint(pixel.x)] = instance;
#endif

    uint corner = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)) * 3u;
    vec2 uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
    vec3 object_normal = vertexNormal(corner) * (1.0 - uv.x - uv.y) + vertexNormal(corner + 1u) * uv.x +
                         vertexNormal(corner + 2u) * uv.y;
    // Row vector times the inverse of object-to-world: right for any affine transform.
    vec3 normal = normalize(object_normal * mat3(rayQueryGetIntersectionWorldToObjectEXT(query, true)));

    // Phong, with the light at the eye: the reflection's angle to the eye is twice the normal's.
    float diffuse = max(-dot(normal, direction), 0.0);
    float specular = pow(max(2.0 * diffuse * diffuse - 1.0, 0.0), 16.0);
    color = vec3(0.75);
    if (pixel.x + 0.5 > size.x * split) color = instanceColor(instance);
    color = color * diffuse + 0.25 * specular;
    return true;
}

#if COMPUTE_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 0, rgba8) uniform writeonly image2D picture;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec3 color;
    if (!trace(vec2(pixel), color)) color = vec3(0.25);
    imageStore(picture, pixel, vec4(color, 1.0));
}

#elif FRAGMENT_SHADER

layout(location = 0) out vec4 out_color;

void main() {
    vec3 color;
    if (!trace(floor(gl_FragCoord.xy), color)) discard;
    out_color = vec4(color, 1.0);
}

#endif

#endif
