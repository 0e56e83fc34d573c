// Skinned and morphed vertices, metallic-roughness materials, and the pond behind them.

#include <glint/shading.h>
#include <glint/skin.h>

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

#if VERTEX_SHADER || FRAGMENT_SHADER
layout(set = 0, binding = 0) uniform View { Camera camera; };
#endif

#if VERTEX_SHADER
layout(std430, row_major, set = 0, binding = 1) readonly buffer Transforms { mat4x3 transforms[]; };
layout(std430, set = 0, binding = 2) readonly buffer Weights { float target_weights[]; };
layout(std430, set = 0, binding = 3) readonly buffer Targets { float targets[]; };

// SceneModel::Vertices.
layout(push_constant) uniform Item {
    uint first_transform, joint_step;
    uint first_weight, target_count, first_target, vertex_count;
};

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 texcoord_0;
layout(location = 4) in vec2 texcoord_1;
layout(location = 5) in vec4 color;
layout(location = 6) in uvec4 joints;
layout(location = 7) in vec4 weights;

layout(location = 0) out vec3 world_position;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec4 world_tangent;
layout(location = 3) out vec4 texcoords;
layout(location = 4) out vec4 vertex_color;

void main() {
    vec3 p = position, n = normal, t = tangent.xyz;
    for (uint k = 0u; k < target_count; k++) {
        const float weight = target_weights[first_weight + k];
        if (weight == 0.0) continue;
        const uint record = 9u * (first_target + k * vertex_count + uint(gl_VertexIndex));
        p += weight * vec3(targets[record], targets[record + 1u], targets[record + 2u]);
        n += weight * vec3(targets[record + 3u], targets[record + 4u], targets[record + 5u]);
        t += weight * vec3(targets[record + 6u], targets[record + 7u], targets[record + 8u]);
    }
    const uvec4 at = first_transform + joint_step * joints;
    const mat4x3 skin = glintSkin(transforms[at.x], transforms[at.y], transforms[at.z], transforms[at.w], weights);
    world_position = glintTransformPoint(skin, p);
    world_normal = glintTransformNormal(skin, n);
    world_tangent = glintTransformTangent(skin, vec4(t, tangent.w));
    texcoords = vec4(texcoord_0, texcoord_1);
    vertex_color = color;
    gl_Position = camera.projection * (camera.view * vec4(world_position, 1.0));
}
#endif

#if FRAGMENT_SHADER
struct Use {
    vec4 rows;  // of the transform of texture coordinates
    vec2 offset;
    uint texcoord;
    uint is_used;
};

layout(set = 0, binding = 4) uniform Material {
    vec4 base_color;
    vec3 emission;
    float alpha_cutoff;
    float metallic, roughness, normal_scale, occlusion_strength;
    uint alpha;  // 0 opaque, 1 mask, 2 blend
    uint is_unlit;
    Use color_use, surface_use, normal_use, occlusion_use, emission_use;
};

layout(set = 0, binding = 5) uniform texture2D color_map;
layout(set = 0, binding = 6) uniform texture2D surface_map;
layout(set = 0, binding = 7) uniform texture2D normal_map;
layout(set = 0, binding = 8) uniform texture2D occlusion_map;
layout(set = 0, binding = 9) uniform texture2D emission_map;
layout(set = 0, binding = 10) uniform sampler color_sampler;
layout(set = 0, binding = 11) uniform sampler surface_sampler;
layout(set = 0, binding = 12) uniform sampler normal_sampler;
layout(set = 0, binding = 13) uniform sampler occlusion_sampler;
layout(set = 0, binding = 14) uniform sampler emission_sampler;

layout(location = 0) in vec3 world_position;
layout(location = 1) in vec3 world_normal;
layout(location = 2) in vec4 world_tangent;
layout(location = 3) in vec4 texcoords;
layout(location = 4) in vec4 vertex_color;

layout(location = 0) out vec4 light;

const float pi = 3.14159265;
const vec3 sun_direction = vec3(0.42, 0.84, 0.34);
const vec3 sun = vec3(2.7, 2.5, 2.25);

// The material is the same for the whole draw, so no texture's derivatives are of a branch that some pixels leave out.
vec4 readMap(texture2D map, sampler how, Use use, vec4 without) {
    if (use.is_used == 0u) return without;
    const vec2 place = use.texcoord == 0u ? texcoords.xy : texcoords.zw;
    return texture(sampler2D(map, how), use.offset + vec2(dot(use.rows.xy, place), dot(use.rows.zw, place)));
}

// What comes from a direction: a bright sky above, deep water below. `roughness` blurs the border.
vec3 surroundings(vec3 direction, float roughness) {
    const float width = mix(0.15, 1.2, roughness);
    const float up = smoothstep(-width, width, direction.y);
    const float window = smoothstep(0.55 - 0.4 * width, 0.55 + 0.6 * width, direction.y);
    return mix(vec3(0.02, 0.07, 0.08), vec3(0.22, 0.42, 0.45), up) + window * vec3(0.75, 0.72, 0.62);
}

// Metallic-roughness of glTF 2.0, appendix B: GGX with the height-correlated Smith term, Schlick's Fresnel term.
vec3 reflectSun(vec3 n, vec3 v, vec3 body, vec3 straight, float roughness) {
    const vec3 l = normalize(sun_direction);
    const vec3 h = normalize(l + v);
    const float nl = max(dot(n, l), 0.0), nv = max(dot(n, v), 1e-3), nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
    const float a = roughness * roughness, aa = a * a;
    const float spread = nh * nh * (aa - 1.0) + 1.0;
    const float distribution = aa / (pi * spread * spread);
    const float visible = 0.5 / max(nl * sqrt(nv * nv * (1.0 - aa) + aa) + nv * sqrt(nl * nl * (1.0 - aa) + aa), 1e-4);
    const vec3 fresnel = straight + (1.0 - straight) * pow(1.0 - vh, 5.0);
    return sun * nl * ((1.0 - fresnel) * body / pi + fresnel * distribution * visible);
}

void main() {
    const vec4 base = base_color * vertex_color * readMap(color_map, color_sampler, color_use, vec4(1.0));
    if (alpha == 1u && base.a < alpha_cutoff) discard;
    const float opacity = alpha == 2u ? base.a : 1.0;
    if (is_unlit != 0u) {
        light = vec4(base.rgb * opacity, opacity);
        return;
    }
    const vec4 surface = readMap(surface_map, surface_sampler, surface_use, vec4(1.0));
    const float metal = metallic * surface.b;
    const float rough = clamp(roughness * surface.g, 0.045, 1.0);

    // Both sides are shown, so that a joint may mirror what follows it.
    const vec3 v = normalize(camera.position.xyz - world_position);
    const vec3 face = cross(dFdx(world_position), dFdy(world_position));
    const vec3 seen = dot(face, v) < 0.0 ? -face : face;
    vec3 n = dot(world_normal, world_normal) > 0.0 ? normalize(world_normal) : normalize(seen);
    const float side = dot(n, seen) < 0.0 ? -1.0 : 1.0;
    if (normal_use.is_used != 0u && dot(world_tangent.xyz, world_tangent.xyz) > 0.0) {
        const vec3 mapped = readMap(normal_map, normal_sampler, normal_use, vec4(0.0)).xyz * 2.0 - 1.0;
        const vec3 t = normalize(world_tangent.xyz - n * dot(n, world_tangent.xyz));
        const vec3 b = cross(n, t) * (world_tangent.w < 0.0 ? -1.0 : 1.0);
        n = normalize((t * mapped.x + b * mapped.y) * normal_scale + n * mapped.z);
    }
    n *= side;

    const vec3 body = base.rgb * (1.0 - metal);
    const vec3 straight = mix(vec3(0.04), base.rgb, metal);
    // Karis, "Physically Based Shading on Mobile", 2014: what a surface mirrors of all that surrounds it.
    const float nv = clamp(dot(n, v), 0.0, 1.0);
    const vec4 r = rough * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    const float k = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    const vec2 scale_bias = vec2(-1.04, 1.04) * k + r.zw;
    const float shade = mix(1.0, readMap(occlusion_map, occlusion_sampler, occlusion_use, vec4(1.0)).r, occlusion_strength);
    const vec3 ambient = body * surroundings(n, 1.0) * 0.8 +
                         (straight * scale_bias.x + scale_bias.y) * surroundings(reflect(-v, n), rough);
    const vec3 glow = emission * readMap(emission_map, emission_sampler, emission_use, vec4(1.0)).rgb;
    const vec3 color = reflectSun(n, v, body, straight, rough) + ambient * shade + glow;
    light = vec4(color * opacity, opacity);
}
#endif

#if TONE_SHADER
layout(set = 0, binding = 0) uniform texture2D light;
layout(set = 0, binding = 1, rgba8) uniform writeonly image2D picture;
layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    const ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    const vec4 texel = texelFetch(light, pixel, 0);
    // Deep water, lighter where the sun comes from.
    const vec2 place = (vec2(pixel) + 0.5) / vec2(size);
    const vec3 water = mix(vec3(0.012, 0.06, 0.066), vec3(0.06, 0.19, 0.19), exp(-2.2 * dot(place - vec2(0.6, 0.25), place - vec2(0.6, 0.25))));
    const vec3 color = texel.rgb + (1.0 - texel.a) * water;
    // Bright colours come closer to white and do not get beyond it.
    const float brightest = max(color.r, max(color.g, color.b));
    const float mapped = brightest <= 0.7 ? brightest : 0.7 + 0.3 * (1.0 - exp(-(brightest - 0.7) / 0.3));
    const vec3 shown = color * (mapped / max(brightest, 1e-6));
    imageStore(picture, pixel, vec4(glintEncodeSrgb(shown), 1.0));
}
#endif
