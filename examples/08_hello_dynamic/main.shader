#if DEFORM_SHADER

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform Parameters {
    uint vertices;  // of a model
    uint grid;
    float ring;  // radius of the circle that the tube follows
    float amount, time;
};

// A position and a normal each.
layout(std430, set = 0, binding = 1) readonly buffer Rest { float rest[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Deformed { float deformed[]; };

/// A point of the model at rest, or near it, to its place now. `model`: column and row, from 0 to 1.
vec3 deform(vec3 p, vec2 model) {
    // Ridges that wind around the tube; more of them from column to column.
    vec3 center = vec3(normalize(p.xy) * ring, 0.0);
    vec3 spoke = p - center;
    float around = atan(p.y, p.x);
    float across = atan(spoke.z, length(p.xy) - ring);
    float ridges = floor(2.0 + 8.0 * model.x + 0.5);
    p = center + spoke * (1.0 + 0.25 * min(amount, 1.0) * sin(ridges * around + 2.0 * across + 2.0 * time));
    // A twist about the X axis: to the left in the first rows, to the right in the last.
    float angle = amount * (2.0 * model.y - 1.0) * p.x + 0.4 * sin(time + 6.0 * (model.x + model.y));
    return vec3(p.x, cos(angle) * p.y - sin(angle) * p.z, sin(angle) * p.y + cos(angle) * p.z);
}

void main() {
    uint vertex = gl_GlobalInvocationID.x, model = gl_GlobalInvocationID.y;
    if (vertex >= vertices || model >= grid * grid) return;
    uint from = vertex * 6u, to = (model * vertices + vertex) * 6u;
    vec3 p = vec3(rest[from], rest[from + 1u], rest[from + 2u]);
    vec3 n = vec3(rest[from + 3u], rest[from + 4u], rest[from + 5u]);
    vec2 place = vec2(model % grid, model / grid) / float(grid - 1u);

    // The normal is across what two tangents become. Differences over 2^-7 of a shape whose waves are 0.5 long: off by
    // a degree at most.
    const float h = 0.0078125;
    vec3 s = normalize(abs(n.z) < 0.7 ? cross(n, vec3(0.0, 0.0, 1.0)) : cross(n, vec3(1.0, 0.0, 0.0))) * h;
    vec3 t = cross(n, s);
    vec3 normal =
        normalize(cross(deform(p + s, place) - deform(p - s, place), deform(p + t, place) - deform(p - t, place)));
    vec3 position = deform(p, place);
    for (int i = 0; i < 3; i++) {
        deformed[to + uint(i)] = position[i];
        deformed[to + 3u + uint(i)] = normal[i];
    }
}

#elif TRACE_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    uint vertices;
    uint grid;
    float floor_z;
};

layout(std430, set = 0, binding = 1) readonly buffer Vertices { float vertex_data[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };

layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;

layout(set = 2, binding = 0, rgba8) uniform writeonly image2D picture;

const vec3 sun = vec3(-0.4243, -0.5657, 0.7071);
const float far = 1000.0;

vec3 sky(vec3 direction) { return mix(vec3(0.80, 0.86, 0.92), vec3(0.25, 0.42, 0.68), sqrt(max(direction.z, 0.0))); }

/// Columns differ in hue, rows in how light they are.
vec3 modelColor(uint model) {
    float hue = float(model % grid) / float(grid), light = float(model / grid) / float(grid - 1u);
    vec3 color = 0.5 + 0.5 * cos(6.2831853 * (hue + vec3(0.0, 0.33, 0.67)));
    return mix(vec3(0.75), color, 0.75) * (0.45 + 0.4 * light);
}

vec3 vertexNormal(uint vertex) {
    uint at = vertex * 6u + 3u;
    return vec3(vertex_data[at], vertex_data[at + 1u], vertex_data[at + 2u]);
}

float shadow(vec3 position) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, position, 0.0,
                          sun, far);
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT ? 1.0 : 0.0;
}

/// What the sun and the sky send on from a surface.
vec3 lit(vec3 position, vec3 normal, vec3 direction, vec3 color, float gloss) {
    float facing = dot(normal, sun);
    // Points are off by some 1e-5 of their distance; a thousandth of a unit is more, and too little to be seen.
    float sunlight = facing > 0.0 ? facing * shadow(position + normal * 1e-3) : 0.0;
    vec3 light = color * (sunlight * vec3(1.15, 1.05, 0.9) + (0.32 + 0.18 * normal.z) * vec3(0.75, 0.85, 1.0));
    float highlight = pow(max(dot(reflect(direction, normal), sun), 0.0), 40.0);
    return light + gloss * (sunlight > 0.0 ? highlight : 0.0);
}

vec3 trace(vec3 origin, vec3 direction) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, direction, far);
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT) {
        uint model = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
        uint corner = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)) * 3u;
        vec2 uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
        vec3 object_normal = vertexNormal(model * vertices + indices[corner]) * (1.0 - uv.x - uv.y) +
                             vertexNormal(model * vertices + indices[corner + 1u]) * uv.x +
                             vertexNormal(model * vertices + indices[corner + 2u]) * uv.y;
        // Row vector times the inverse of object-to-world: right for any affine transform.
        vec3 normal = normalize(object_normal * mat3(rayQueryGetIntersectionWorldToObjectEXT(query, true)));
        vec3 position = origin + direction * rayQueryGetIntersectionTEXT(query, true);
        return lit(position, normal, direction, modelColor(model), 0.35);
    }
    // The floor is a plane, which fades into the sky.
    float t = (floor_z - origin.z) / direction.z;
    if (!(t > 0.0 && t < far)) return sky(direction);
    vec3 position = origin + direction * t;
    float haze = exp(-0.0006 * dot(position.xy, position.xy));
    if (haze < 0.01) return sky(vec3(direction.xy, 0.0));
    return mix(sky(vec3(direction.xy, 0.0)), lit(position, vec3(0.0, 0.0, 1.0), direction, vec3(0.62, 0.6, 0.57), 0.0),
               haze);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    vec2 place = (vec2(pixel) + 0.5) / vec2(size);
    vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);
    vec3 color = trace(camera.position.xyz, direction);
    imageStore(picture, pixel, vec4(pow(min(color, 1.0), vec3(1.0 / 2.2)), 1.0));
}

#endif
