#include "../common/course.shader"

layout(set = 1, binding = 0) uniform Settings { uint use_geometric; };

vec3 normalColor(Surface surface) { return (use_geometric != 0u ? surface.point.normal : surface.normal) * 0.5 + 0.5; }

const vec3 background = vec3(0.25);

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT vec3 color;

void main() {
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, cameraDirection(), far, 0);
    storePixel(color);
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = background; }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = normalColor(hitSurface()); }

#elif QUERY_SHADER

void main() {
    if (isOutside()) return;
    Surface surface;
    storePixel(closestSurface(camera.position.xyz, cameraDirection(), surface) ? normalColor(surface) : background);
}

#endif
