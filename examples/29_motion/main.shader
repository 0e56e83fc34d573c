#if MORPH_SHADER

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform Settings {
    uint vertices, first;
    float weight;
    uint padding;
};

// A position and a normal each: six floats. The mesh at rest is what `deformed` begins with.
layout(std430, set = 0, binding = 1) readonly buffer Target { float target[]; };
layout(std430, set = 0, binding = 2) buffer Deformed { float deformed[]; };

void main() {
    const uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertices) return;
    for (uint i = 0u; i < 6u; i++)
        deformed[(first + vertex) * 6u + i] = mix(deformed[vertex * 6u + i], target[vertex * 6u + i], weight);
}

#else

#include "../common/course.shader"

layout(set = 0, binding = 5, rgba32f) uniform image2D sums;  // of colours, and how many there are
layout(set = 1, binding = 0) uniform Settings {
    uint slice, slices;
    float rolling;
    uint is_matte;
};

const float specular = 0.4, shininess = 40.0;

/// What a ray finds.
struct Hit {
    bool is_hit;
    Surface surface;
};

#if RAYGEN_SHADER || QUERY_SHADER

bool nearest(vec3 origin, vec3 direction, out Surface surface);
bool isFree(vec3 origin, vec3 way);

/// Matrix keys, keys of scale, rotation and translation, morphing.
vec3 colorOf(Surface surface) {
    if (surface.object == object_floor) return surfaceColor(surface);
    return surface.object == 0u ? vec3(0.80, 0.42, 0.22) :
           surface.object == 2u ? vec3(0.24, 0.46, 0.72) :
                                  vec3(0.42, 0.62, 0.30);
}

vec3 traced() {
    const vec3 direction = cameraDirection();
    Surface surface;
    if (!nearest(camera.position.xyz, direction, surface)) return is_matte != 0u ? vec3(0.0) : sky(direction);
    if (is_matte != 0u) return vec3(surface.object != object_floor ? 1.0 : 0.0);
    float visible = 0.0;
    if (facesLight(surface)) {
        vec3 origin, way;
        glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
        visible = isFree(origin, way) ? 1.0 : 0.0;
    }
    return phong(surface, colorOf(surface), direction, visible, specular, shininess);
}

/// True if the pixel's row is exposed at the moment of this slice: for 1 - rolling of the time, from row to row later;
/// at least for one slice.
bool isExposed() {
    const float row = (float(PIXEL.y) + 0.5) / float(imageSize(picture).y);
    const float begin = row * rolling * float(slices), end = begin + (1.0 - rolling) * float(slices);
    const float moment = float(slice) + 0.5;
    return slice == min(uint(0.5 * (begin + end)), slices - 1u) || (moment >= begin && moment < end);
}

void main() {
#if QUERY_SHADER
    if (isOutside()) return;
#endif
    vec4 sum = slice == 0u ? vec4(0.0) : imageLoad(sums, ivec2(PIXEL));
    if (isExposed()) sum += vec4(traced(), 1.0);
    imageStore(sums, ivec2(PIXEL), sum);
    if (slice + 1u < slices) return;
    const vec3 mean = sum.rgb / sum.a;
    storePixel(is_matte != 0u ? mean : glintEncodeSrgb(mean));
}

#endif

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT Hit found;

bool nearest(vec3 origin, vec3 direction, out Surface surface) {
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, origin, 0.0, direction, far, 0);
    surface = found.surface;
    return found.is_hit;
}

bool isFree(vec3 origin, vec3 way) {
    found.is_hit = true;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT,
                0xff, 0, 0, 0, origin, 0.0, way, GLINT_SEGMENT_END, 0);
    return !found.is_hit;
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT Hit found;

void main() { found.is_hit = false; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT Hit found;

void main() { found = Hit(true, hitSurface()); }

#elif QUERY_SHADER

bool nearest(vec3 origin, vec3 direction, out Surface surface) { return closestSurface(origin, direction, surface); }

bool isFree(vec3 origin, vec3 way) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, origin, 0.0,
                          way, GLINT_SEGMENT_END);
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT;
}

#endif

#endif
