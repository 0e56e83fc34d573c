#include "../common/course.shader"

#include <glint/random.h>

layout(set = 1, binding = 0) uniform Settings {
    float repeats, opacity;
    uint is_stochastic, samples;
};
layout(set = 1, binding = 1) uniform texture2D holes;
layout(set = 1, binding = 2) uniform sampler holes_sampler;

const float specular = 0.4, shininess = 40.0;

/// True if the mesh is there, and false in a hole. The texture goes through the mesh along the axis that the triangle
/// looks along most. A random hit depends on what it is alone, as hits are shown in any order, and perhaps twice.
bool isThere(uint first_triangle, uint primitive, vec2 barycentrics, uint seed) {
    const uint corner = (first_triangle + primitive) * 3u;
    const vec3 a = vertexPosition(indices[corner]), b = vertexPosition(indices[corner + 1u]);
    const vec3 c = vertexPosition(indices[corner + 2u]);
    const vec3 place = glintInterpolate(a, b, c, barycentrics) * repeats;
    const vec3 size = abs(cross(b - a, c - a));
    const vec2 uv = size.x > max(size.y, size.z) ? place.yz : size.y > size.z ? place.zx : place.xy;
    const float there = textureLod(sampler2D(holes, holes_sampler), uv, 0.0).r * opacity;
    return there > (is_stochastic != 0u ? glintUniform(glintHash(seed, primitive)) : 0.5);
}

/// What a ray carries.
struct Path {
    uint seed;
    bool is_hit;
    Surface surface;
};

#if RAYGEN_SHADER || QUERY_SHADER

bool nearest(vec3 origin, vec3 direction, uint seed, out Surface surface);
bool isFree(vec3 origin, vec3 way, uint seed);

vec3 traced(uint seed) {
    const vec3 direction = cameraDirection();
    Surface surface;
    if (!nearest(camera.position.xyz, direction, seed, surface)) return sky(direction);
    float visible = 0.0;
    if (facesLight(surface)) {
        vec3 origin, way;
        glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
        // The triangle may be met again on the other side of a hole, as another ray.
        visible = isFree(origin, way, glintHash(seed)) ? 1.0 : 0.0;
    }
    return phong(surface, direction, visible, specular, shininess);
}

void main() {
#if QUERY_SHADER
    if (isOutside()) return;
#endif
    vec3 color = vec3(0.0);
    for (uint i = 0u; i < samples; i++) color += traced(glintHash(glintHash(PIXEL.x, PIXEL.y), i));
    storePixel(glintEncodeSrgb(color / float(samples)));
}

#endif

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT Path path;

bool nearest(vec3 origin, vec3 direction, uint seed, out Surface surface) {
    path.seed = seed;
    traceRayEXT(scene, gl_RayFlagsNoneEXT, 0xff, 0, 0, 0, origin, 0.0, direction, far, 0);
    surface = path.surface;
    return path.is_hit;
}

/// The any-hit shader says which hits count; the first of those ends the search.
bool isFree(vec3 origin, vec3 way, uint seed) {
    path.seed = seed;
    path.is_hit = true;
    traceRayEXT(scene, gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT, 0xff, 0, 0, 0, origin,
                0.0, way, GLINT_SEGMENT_END, 0);
    return !path.is_hit;
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT Path path;

void main() { path.is_hit = false; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT Path path;

void main() {
    path.is_hit = true;
    path.surface = hitSurface();
}

#elif ANY_HIT_SHADER

layout(location = 0) rayPayloadInEXT Path path;
hitAttributeEXT vec2 barycentrics;

void main() {
    if (!isThere(gl_InstanceCustomIndexEXT, gl_PrimitiveID, barycentrics, path.seed)) ignoreIntersectionEXT;
}

#elif QUERY_SHADER

/// What is not opaque is a candidate, for the program to confirm.
void search(rayQueryEXT query, uint seed) {
    while (rayQueryProceedEXT(query))
        if (isThere(uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, false)),
                    uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)),
                    rayQueryGetIntersectionBarycentricsEXT(query, false), seed))
            rayQueryConfirmIntersectionEXT(query);
}

bool nearest(vec3 origin, vec3 direction, uint seed, out Surface surface) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsNoneEXT, 0xff, origin, 0.0, direction, far);
    search(query, seed);
    return committedSurface(query, direction, surface);
}

bool isFree(vec3 origin, vec3 way, uint seed) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsTerminateOnFirstHitEXT, 0xff, origin, 0.0, way, GLINT_SEGMENT_END);
    search(query, seed);
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT;
}

#endif
