#include "../common/course.shader"

layout(set = 1, binding = 0) uniform Settings {
    float specular;
    float shininess;
};

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

void main() { color = phong(hitSurface(), gl_WorldRayDirectionEXT, 1.0, specular, shininess); }

#elif QUERY_SHADER

void main() {
    if (isOutside()) return;
    const vec3 direction = cameraDirection();
    Surface surface;
    const bool is_hit = closestSurface(camera.position.xyz, direction, surface);
    storePixel(glintEncodeSrgb(is_hit ? phong(surface, direction, 1.0, specular, shininess) : sky(direction)));
}

#endif
