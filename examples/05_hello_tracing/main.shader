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
    vec4 light;
    vec4 size;
};

layout(std430, set = 0, binding = 1) readonly buffer Normals { float normals[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };

layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;

vec3 vertexNormal(uint corner) {
    uint vertex = indices[corner] * 3u;
    return vec3(normals[vertex], normals[vertex + 1u], normals[vertex + 2u]);
}

bool isShadowed(vec3 position, vec3 target) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, position, 0.0,
                          target - position, 1.0);
    rayQueryProceedEXT(query);
    return rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
}

vec3 palette(float x) { return 0.6 + 0.4 * cos(6.28318 * (x + vec3(0.0, 0.33, 0.67))); }

vec4 trace(vec2 pixel) {
    vec3 origin = camera.position.xyz;
    vec2 place = (pixel + 0.5) / size.xy;
    vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);

    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, direction, 1000.0);
    rayQueryProceedEXT(query);
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return vec4(vec3(0.25), 1.0);

    vec3 position = origin + direction * rayQueryGetIntersectionTEXT(query, true);
    vec3 normal = vec3(0.0, 0.0, 1.0);
    vec3 color = vec3(0.75);
    float fade = 0.0;
    if (rayQueryGetIntersectionInstanceCustomIndexEXT(query, true) == 0) {
        uint triangle = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
        vec2 uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
        vec3 object_normal = vertexNormal(triangle * 3u) * (1.0 - uv.x - uv.y) + vertexNormal(triangle * 3u + 1u) * uv.x +
                             vertexNormal(triangle * 3u + 2u) * uv.y;
        // Row vector times object-to-world's inverse: right for any affine transform.
        normal = normalize(object_normal * mat3(rayQueryGetIntersectionWorldToObjectEXT(query, true)));
        if (pixel.x > size.x * size.z) color = palette(float(triangle) * 0.0001);
    } else {
        // A checker that fades into the background.
        color = vec3(0.45 + 0.25 * mod(floor(position.x * 2.0) + floor(position.y * 2.0), 2.0));
        fade = smoothstep(2.0, 7.5, length(position.xy));
    }
    if (dot(normal, direction) > 0.0) normal = -normal;

    vec3 to_light = normalize(light.xyz - position);
    float diffuse = max(dot(normal, to_light), 0.0);
    float specular = diffuse > 0.0 ? pow(max(dot(reflect(-to_light, normal), -direction), 0.0), 16.0) : 0.0;
    float lit = diffuse > 0.0 && !isShadowed(position + normal * size.w, light.xyz) ? 1.0 : 0.0;
    color = color * (0.25 + 0.75 * diffuse * lit) + vec3(0.25 * specular * lit);
    return vec4(mix(color, vec3(0.25), fade), 1.0);
}

#if COMPUTE_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 0, rgba8) uniform writeonly image2D picture;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    imageStore(picture, pixel, trace(vec2(pixel)));
}

#elif FRAGMENT_SHADER

layout(location = 0) out vec4 out_color;

void main() { out_color = trace(floor(gl_FragCoord.xy)); }

#endif

#endif
