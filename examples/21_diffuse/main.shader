#include "../common/course.shader"

layout(set = 1, binding = 0) uniform Settings { float split; };

/// Left of the split with the triangles' normals, right of it with the interpolated ones.
vec3 diffuseColor(Surface surface, uint x) {
    float arriving;
    const vec3 to_light = toLight(surface, arriving);
    const bool is_left = float(x) + 0.5 < split * float(imageSize(picture).x);
    const vec3 normal = is_left ? surface.point.normal : surface.normal;
    return surfaceColor(surface) * (ambient + glintDiffuse(normal, to_light) * arriving);
}

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT vec3 color;

void main() {
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, cameraDirection(), far, 0);
    storePixel(glintEncodeSrgb(color));
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = sky(gl_WorldRayDirectionEXT); }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = diffuseColor(hitSurface(), PIXEL.x); }

#elif QUERY_SHADER

void main() {
    if (isOutside()) return;
    const vec3 direction = cameraDirection();
    Surface surface;
    const bool is_hit = closestSurface(camera.position.xyz, direction, surface);
    storePixel(glintEncodeSrgb(is_hit ? diffuseColor(surface, PIXEL.x) : sky(direction)));
}

#endif
