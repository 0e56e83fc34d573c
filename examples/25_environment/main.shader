#include "../common/course.shader"

#include <glint/environment.h>
#include <glint/random.h>

layout(set = 1, binding = 0) uniform Settings {
    uint samples;
    float exposure;
};
layout(set = 1, binding = 1) uniform texture2D environment;
layout(set = 1, binding = 2) uniform sampler environment_sampler;

const uint mirrors = 2u;                    // that may follow one another
const vec3 metal = vec3(0.94, 0.84, 0.66);  // what it mirrors of each colour

/// What arrives from afar. To the left and right the picture goes on; at the poles it ends.
vec3 surroundings(vec3 direction, float level) {
    const float half_texel = 0.5 * exp2(level) / float(textureSize(sampler2D(environment, environment_sampler), 0).y);
    vec2 place = glintLatitudeLongitude(direction);
    place.y = clamp(place.y, half_texel, 1.0 - half_texel);
    return textureLod(sampler2D(environment, environment_sampler), place, level).rgb;
}
vec3 surroundings(vec3 direction) { return surroundings(direction, 0.0); }

/// The same for one of many directions: of a mip level with 16 texels for each of them, so that a small sun is light
/// instead of noise.
vec3 gathered(vec3 direction) {
    const vec2 size = vec2(textureSize(sampler2D(environment, environment_sampler), 0));
    return surroundings(direction, clamp(0.5 * log2(size.x * size.y / float(samples)) - 2.0, 0.0, log2(size.y) - 2.0));
}

/// Directions about the normal, more of them where they count more: by the cosine. One in each ring of equal share, and
/// each turned against the one before by the golden section, which leaves no large gaps.
vec3 gatherDirection(vec3 normal, uint sample_number, uint seed) {
    const float square = (float(sample_number) + glintUniform(glintHash(seed, sample_number))) / float(samples);
    const float turn = GLINT_TWO_PI * fract(glintUniform(seed) + float(sample_number) * (GLINT_GOLDEN_RATIO - 1.0));
    const vec3 side = normalize(cross(normal, abs(normal.z) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0)));
    return sqrt(square) * (cos(turn) * side + sin(turn) * cross(normal, side)) + sqrt(1.0 - square) * normal;
}

bool isMirror(Surface surface) { return surface.object == object_mesh; }

vec3 mirrored(Surface surface, vec3 direction) {
    return glintMirror(direction, surface.normal, surface.point.normal);
}

/// What the tone curve leaves of any brightness is below 1.
vec3 tone(vec3 color) { return glintEncodeSrgb(1.0 - exp(-exposure * color)); }

#if RAYGEN_SHADER || CLOSEST_SHADER || QUERY_SHADER
uint pixelSeed() { return glintHash(PIXEL.x, PIXEL.y); }
#endif

struct Path {
    vec3 color;
    uint left;  // mirrors that may still follow
};

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT Path path;

void main() {
    path.left = mirrors;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, camera.position.xyz, 0.0, cameraDirection(), far, 0);
    storePixel(tone(path.color));
}

#elif MISS_SHADER

layout(location = 0) rayPayloadInEXT Path path;

void main() { path.color = surroundings(gl_WorldRayDirectionEXT); }

#elif GATHER_MISS_SHADER

layout(location = 1) rayPayloadInEXT vec3 light_sum;

void main() { light_sum += gathered(gl_WorldRayDirectionEXT); }

#elif CLOSEST_SHADER

layout(location = 0) rayPayloadInEXT Path path;
layout(location = 1) rayPayloadEXT vec3 light_sum;
layout(location = 2) rayPayloadEXT Path next;

void main() {
    const Surface surface = hitSurface();
    if (isMirror(surface)) {
        const vec3 direction = mirrored(surface, gl_WorldRayDirectionEXT);
        next.color = surroundings(direction);
        if (path.left > 0u) {
            next.left = path.left - 1u;
            traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, glintSpawnPoint(surface.point, direction), 0.0,
                        direction, far, 2);
        }
        path.color = metal * next.color;
        return;
    }
    // What stands in the way of the light is taken to be dark.
    const uint seed = pixelSeed();
    light_sum = vec3(0.0);
    for (uint i = 0u; i < samples; i++) {
        const vec3 direction = gatherDirection(surface.normal, i, seed);
        traceRayEXT(scene,
                    gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT,
                    0xff, 0, 0, 1, glintSpawnPoint(surface.point, direction), 0.0, direction, far, 1);
    }
    path.color = surfaceColor(surface) * light_sum / float(samples);
}

#elif QUERY_SHADER

bool isFree(vec3 origin, vec3 direction) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, origin, 0.0,
                          direction, far);
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT;
}

void main() {
    if (isOutside()) return;
    vec3 origin = camera.position.xyz, direction = cameraDirection(), open = vec3(1.0);
    Surface surface;
    bool is_matt = false;
    for (uint left = mirrors + 1u; left > 0u && closestSurface(origin, direction, surface); left--) {
        is_matt = !isMirror(surface);
        if (is_matt) break;
        open *= metal;
        direction = mirrored(surface, direction);
        origin = glintSpawnPoint(surface.point, direction);
    }
    vec3 color = vec3(0.0);
    if (is_matt) {
        const uint seed = pixelSeed();
        for (uint i = 0u; i < samples; i++) {
            const vec3 way = gatherDirection(surface.normal, i, seed);
            if (isFree(glintSpawnPoint(surface.point, way), way)) color += gathered(way);
        }
        color *= surfaceColor(surface) / float(samples);
    } else {
        color = surroundings(direction);
    }
    storePixel(tone(open * color));
}

#endif
