#include "../common/course.shader"

layout(set = 1, binding = 0) uniform Settings { uint reflections; };

struct Path {
    vec3 color;
    uint left;  // reflections that may still follow
};

const float specular = 0.4, shininess = 40.0;

/// The share of what a surface shows that is mirrored.
float mirroring(Surface surface) { return surface.object == object_mesh ? 0.75 : 0.25; }

vec3 mirrored(Surface surface, vec3 direction) {
    return glintMirror(direction, surface.normal, surface.point.normal);
}

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT Path path;

void main() {
    path.left = reflections;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, cameraDirection(), far, 0);
    storePixel(glintEncodeSrgb(path.color));
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT Path path;

void main() { path.color = sky(gl_WorldRayDirectionEXT); }

#elif SHADOW_MISS_SHADER

layout(location = 1) rayPayloadInEXT float visible;

void main() { visible = 1.0; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT Path path;
layout(location = 1) rayPayloadEXT float visible;
layout(location = 2) rayPayloadEXT Path next;

void main() {
    const Surface surface = hitSurface();
    visible = 0.0;
    if (facesLight(surface)) {
        vec3 origin, way;
        glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
        traceRayEXT(scene,
                    gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT,
                    0xff, 0, 0, 1, origin, 0.0, way, GLINT_SEGMENT_END, 1);
    }
    const vec3 color = phong(surface, gl_WorldRayDirectionEXT, visible, specular, shininess);

    const vec3 direction = mirrored(surface, gl_WorldRayDirectionEXT);
    next.color = sky(direction);  // what the last mirror shows
    if (path.left > 0u) {
        next.left = path.left - 1u;
        traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, glintSpawnPoint(surface.point, direction), 0.0,
                    direction, far, 2);
    }
    path.color = mix(color, next.color, mirroring(surface));
}

#elif QUERY_SHADER

// What recursion does on the way back, this does on the way out: it keeps what share of the picture is still open.
void main() {
    if (isOutside()) return;
    vec3 origin = camera.position.xyz, direction = cameraDirection(), color = vec3(0.0);
    float open = 1.0;
    Surface surface;
    for (uint left = reflections + 1u; left > 0u && closestSurface(origin, direction, surface); left--) {
        const float share = mirroring(surface);
        color += open * (1.0 - share) * phong(surface, direction, visibility(surface), specular, shininess);
        open *= share;
        direction = mirrored(surface, direction);
        origin = glintSpawnPoint(surface.point, direction);
    }
    storePixel(glintEncodeSrgb(color + open * sky(direction)));
}

#endif
