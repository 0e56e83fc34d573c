#include "../common/course.shader"

const float specular = 0.4, shininess = 40.0;

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT vec3 color;

void main() {
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, cameraDirection(), far, 0);
    storePixel(glintEncodeSrgb(color));
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = sky(gl_WorldRayDirectionEXT); }

#elif SHADOW_MISS_SHADER

layout(location = 1) rayPayloadInEXT float visible;

void main() { visible = 1.0; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;
layout(location = 1) rayPayloadEXT float visible;

void main() {
    const Surface surface = hitSurface();
    visible = 0.0;
    if (facesLight(surface)) {
        vec3 origin, way;
        glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
        // Either every hit ends the search, and the miss shader says that there was none; or hits are shown to an
        // any-hit shader, that of the second hit group, which ends it.
#if ANY_HIT
        visible = 1.0;
        const uint flags = gl_RayFlagsNoOpaqueEXT | gl_RayFlagsSkipClosestHitShaderEXT, group = 1u;
#else
        const uint flags =
            gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;
        const uint group = 0u;
#endif
        traceRayEXT(scene, flags, 0xff, group, 0, 1, origin, 0.0, way, GLINT_SEGMENT_END, 1);
    }
    color = phong(surface, gl_WorldRayDirectionEXT, visible, specular, shininess);
}

#elif ANY_HIT_SHADER

layout(location = 1) rayPayloadInEXT float visible;

void main() {
    visible = 0.0;
    terminateRayEXT;
}

#elif QUERY_SHADER

#if ANY_HIT

/// Hits that are not opaque are candidates: the first one is enough.
float anyVisibility(Surface surface) {
    if (!facesLight(surface)) return 0.0;
    vec3 origin, way;
    glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsNoOpaqueEXT, 0xff, origin, 0.0, way, GLINT_SEGMENT_END);
    return rayQueryProceedEXT(query) ? 0.0 : 1.0;
}
#define visibility anyVisibility

#endif

void main() {
    if (isOutside()) return;
    const vec3 direction = cameraDirection();
    Surface surface;
    vec3 color = sky(direction);
    if (closestSurface(camera.position.xyz, direction, surface))
        color = phong(surface, direction, visibility(surface), specular, shininess);
    storePixel(glintEncodeSrgb(color));
}

#endif
