#include "../common/course.shader"

layout(set = 1, binding = 0) uniform Settings { uint bounces; float index; };
layout(std430, set = 1, binding = 1) readonly buffer Planes { vec4 planes[]; };
layout(std430, set = 1, binding = 2) readonly buffer Ranges { uvec2 ranges[]; };  // of each box: first plane, count

const float specular = 0.4, shininess = 40.0;
const vec3 absorption = vec3(0.18, 0.05, 0.07);  // of a unit of glass
const uint solids = 1u, all = 0xffu;             // masks

/// What is nearest on a ray.
struct Hit {
    bool is_hit, is_glass;
    Surface surface;  // of glass: position and normal, which points outwards
};

/// A body lets through what is thinner, so that rounding at its edges is no body.
const float thinnest = 1e-5;

/// Where a ray is between all planes of a hull: it enters with the last one that it crosses inwards, and leaves with the
/// first one that it crosses outwards. False if that is nowhere.
bool hullInterval(uint hull, vec3 origin, vec3 direction, out vec2 t, out uvec2 sides) {
    t = vec2(-far, far);
    sides = uvec2(0u);
    for (uint i = 0u; i < ranges[hull].y; i++) {
        const vec4 plane = planes[ranges[hull].x + i];
        const float height = plane.w - dot(plane.xyz, origin), speed = dot(plane.xyz, direction);
        if (speed == 0.0 && height < 0.0) return false;
        const float crossing = speed == 0.0 ? far : height / speed;
        if (speed < 0.0 && crossing > t.x) {
            t.x = crossing;
            sides.x = ranges[hull].x + i;
        } else if (speed > 0.0 && crossing < t.y) {
            t.y = crossing;
            sides.y = ranges[hull].x + i;
        }
    }
    return t.y - t.x > thinnest;
}

/// Where a ray meets the hull, and which plane. As triangles do it obeys the flags that cull: rays within glass do not
/// see front faces, those outside do not see back faces. So a ray never meets again what it leaves, and needs no offset.
bool hullHit(uint hull, vec3 origin, vec3 direction, bool is_inside, out float t, out uint side) {
    vec2 interval;
    uvec2 sides;
    const bool is_met = hullInterval(hull, origin, direction, interval, sides);
    t = is_inside ? max(interval.y, 0.0) : interval.x;
    side = is_inside ? sides.y : sides.x;
    // Inside of this one, not of another.
    return is_met && (is_inside ? interval.x < thinnest && interval.y > -thinnest : interval.x >= 0.0);
}

#if RAYGEN_SHADER || QUERY_SHADER

Hit nearest(vec3 origin, vec3 direction, bool is_inside);
bool isFree(vec3 origin, vec3 way);

vec3 shaded(Surface surface, vec3 direction) {
    float visible = 0.0;
    if (facesLight(surface)) {
        vec3 origin, way;
        glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
        visible = isFree(origin, way) ? 1.0 : 0.0;
    }
    return phong(surface, direction, visible, specular, shininess);
}

/// A ray outside of glass, and how much of it is still open.
struct Way {
    vec3 origin, direction, open;
};

/// What is seen along one way through the glass, and the way that its first side mirrors. Within glass a side mirrors
/// only where nothing gets out.
vec3 followed(Way way, out Way mirrored) {
    mirrored = Way(vec3(0.0), vec3(0.0), vec3(0.0));
    bool is_inside = false;
    for (uint left = bounces; left > 0u; left--) {
        const Hit hit = nearest(way.origin, way.direction, is_inside);
        if (!hit.is_hit) break;
        if (is_inside) way.open *= exp(-absorption * distance(way.origin, hit.surface.point.position));
        if (!hit.is_glass) return way.open * shaded(hit.surface, way.direction);
        way.origin = hit.surface.point.position;
        const vec3 normal = glintFaceRay(hit.surface.normal, way.direction);
        const float eta = is_inside ? index : 1.0 / index;
        const float share = glintFresnel(-dot(normal, way.direction), eta);
        const vec3 reflected = reflect(way.direction, normal);
        if (left == bounces) mirrored = Way(way.origin, reflected, way.open * share);
        if (share < 1.0) {
            way.open *= 1.0 - share;
            way.direction = normalize(refract(way.direction, normal, eta));
            is_inside = !is_inside;
        } else {
            way.direction = reflected;
        }
    }
    return way.open * sky(way.direction);
}

void main() {
#if QUERY_SHADER
    if (isOutside()) return;
#endif
    Way way = Way(camera.position.xyz, cameraDirection(), vec3(1.0)), mirrored;
    vec3 color = vec3(0.0);
    for (uint i = 0u; i < 2u; i++) {
        color += followed(way, mirrored);
        if (mirrored.open == vec3(0.0)) break;
        way = mirrored;
    }
    storePixel(glintEncodeSrgb(color));
}

#endif

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT Hit found;

Hit nearest(vec3 origin, vec3 direction, bool is_inside) {
    const uint culling = is_inside ? gl_RayFlagsCullFrontFacingTrianglesEXT : gl_RayFlagsCullBackFacingTrianglesEXT;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT | culling, all, 0, 0, 0, origin, 0.0, direction, far, 0);
    return found;
}

bool isFree(vec3 origin, vec3 way) {
    found.is_hit = true;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT,
                solids, 0, 0, 0, origin, 0.0, way, GLINT_SEGMENT_END, 0);
    return !found.is_hit;
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT Hit found;

void main() { found.is_hit = false; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT Hit found;

void main() { found = Hit(true, false, hitSurface()); }

#elif INTERSECTION_SHADER

hitAttributeEXT uint hit_side;

void main() {
    const bool is_inside = (gl_IncomingRayFlagsEXT & gl_RayFlagsCullFrontFacingTrianglesEXT) != 0u;
    float t;
    uint side;
    if (!hullHit(gl_PrimitiveID, gl_ObjectRayOriginEXT, gl_ObjectRayDirectionEXT, is_inside, t, side)) return;
    // What is beyond the nearest hit would be refused, but lavapipe (Mesa 25.0) has its attributes take the place of the
    // nearest one's all the same.
    if (t >= gl_RayTmaxEXT) return;
    hit_side = side;
    reportIntersectionEXT(t, 0u);
}

#elif GLASS_SHADER

layout(location = 0) rayPayloadInEXT Hit found;
hitAttributeEXT uint hit_side;

void main() {
    found.is_hit = true;
    found.is_glass = true;
    found.surface.point = glintFreePoint(gl_WorldRayOriginEXT + gl_WorldRayDirectionEXT * gl_HitTEXT);
    found.surface.normal = planes[hit_side].xyz;
}

#elif QUERY_SHADER

Hit nearest(vec3 origin, vec3 direction, bool is_inside) {
    Hit hit;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, all, origin, 0.0, direction, far);
    float nearest_t = far;
    uint nearest_side = 0u;
    // Boxes are candidates even where they are opaque.
    while (rayQueryProceedEXT(query)) {
        float t;
        uint side;
        if (!hullHit(uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)), origin, direction, is_inside, t,
                     side) ||
            t >= nearest_t)
            continue;
        nearest_t = t;
        nearest_side = side;
        rayQueryGenerateIntersectionEXT(query, t);
    }
    hit.is_glass = rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionGeneratedEXT;
    hit.is_hit = committedSurface(query, direction, hit.surface) || hit.is_glass;
    if (hit.is_glass) {
        hit.surface.point = glintFreePoint(origin + direction * nearest_t);
        hit.surface.normal = planes[nearest_side].xyz;
    }
    return hit;
}

bool isFree(vec3 origin, vec3 way) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, solids, origin, 0.0,
                          way, GLINT_SEGMENT_END);
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT;
}

#endif
