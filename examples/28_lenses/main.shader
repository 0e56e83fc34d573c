#include "../common/course.shader"

#include <glint/lens.h>

struct Material {
    vec4 color;
    float specular, shininess;
    vec2 padding;
};

layout(set = 1, binding = 0) uniform Settings { uint lens; float angle; };
// What the hit groups' records hold, for queries, which have no records.
layout(set = 1, binding = 1) uniform Materials { Material materials[7]; };

/// What a lens is asked, and answers.
struct View {
    vec2 place;  // from (-1, -1) at the picture's bottom left to (1, 1)
    float aspect;
    vec3 direction;  // in the camera's space; zero where the lens shows nothing
};

void pinholeLens(inout View view) { view.direction = glintPinholeLens(view.place * vec2(view.aspect, 1.0), angle); }
void fisheyeLens(inout View view) { view.direction = glintFisheyeLens(view.place * vec2(view.aspect, 1.0), angle); }
void sphericalLens(inout View view) { view.direction = glintSphericalLens(view.place); }

vec3 shaded(Surface surface, Material material, vec3 direction, float visible) {
    const bool is_floor = surface.object == 0u;
    const vec3 checkers = mod(dot(floor(surface.point.position.xy), vec2(1.0)), 2.0) < 0.5 ? vec3(0.62) : vec3(0.30);
    return phong(surface, is_floor ? checkers : material.color.rgb, direction, visible, material.specular,
                 material.shininess);
}

#if RAYGEN_SHADER || QUERY_SHADER

View viewOf(uvec2 pixel) {
    const vec2 size = vec2(imageSize(picture)), place = (vec2(pixel) + 0.5) / size;
    return View(vec2(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0), size.x / size.y, vec3(0.0));
}

vec3 inWorld(vec3 direction) { return normalize(mat3(camera.inverse_view) * direction); }

#endif

#if CALLABLE_SHADER

layout(location = 0) callableDataInEXT View view;

void main() { LENS(view); }

#elif RAYGEN_SHADER

layout(location = 0) rayPayloadEXT vec3 color;
layout(location = 0) callableDataEXT View view;

void main() {
    view = viewOf(PIXEL);
    executeCallableEXT(lens, 0);
    color = vec3(0.0);
    if (view.direction != vec3(0.0))
        traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, inWorld(view.direction), far,
                    0);
    storePixel(glintEncodeSrgb(color));
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT vec3 color;

void main() { color = sky(gl_WorldRayDirectionEXT); }

#elif SHADOW_MISS_SHADER

layout(location = 1) rayPayloadInEXT float visible;

void main() { visible = 1.0; }

#elif CLOSEST_SHADER

layout(shaderRecordEXT, std430) buffer Record { Material material; };
layout(location = 0) rayPayloadInEXT vec3 color;
layout(location = 1) rayPayloadEXT float visible;

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
    color = shaded(surface, material, gl_WorldRayDirectionEXT, visible);
}

#elif QUERY_SHADER

void main() {
    if (isOutside()) return;
    View view = viewOf(PIXEL);
    if (lens == 0u)
        pinholeLens(view);
    else if (lens == 1u)
        fisheyeLens(view);
    else
        sphericalLens(view);
    vec3 color = vec3(0.0);
    if (view.direction != vec3(0.0)) {
        const vec3 direction = inWorld(view.direction);
        rayQueryEXT query;
        rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, camera.position.xyz, 0.0, direction, far);
        while (rayQueryProceedEXT(query)) {}
        Surface surface;
        color = sky(direction);
        if (committedSurface(query, direction, surface)) {
            const uint material = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(query, true);
            color = shaded(surface, materials[material], direction, visibility(surface));
        }
    }
    storePixel(glintEncodeSrgb(color));
}

#endif
