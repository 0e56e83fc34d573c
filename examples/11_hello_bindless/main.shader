// One ray query for each pixel and one for its reflection; materials read whichever textures of the table they name.

#include <glint/ray.h>
#include <glint/shading.h>

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform Parameters {
    Camera camera;
    vec4 light;         // where it is; its reach, in which it fades to a half
    float pixel_angle;  // between the rays of neighbouring pixels
    uint reflects;
};

// Eight floats each: position, normal (0: the triangle's), texture coordinates.
layout(std430, set = 0, binding = 1) readonly buffer Vertices { float vertices[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };

struct TextureUse {
    uint texture;  // of the table; ~0: none
    float rotation;
    vec2 offset, scale;
};
struct Material {
    vec4 base_color;
    TextureUse color_use, normal_use, surface_use;
    float metallic, roughness, normal_scale;
    uint first_index;
};
// One for each geometry of the structure.
layout(std430, set = 0, binding = 3) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 4) uniform sampler trilinear;

layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 2, binding = 0, rgba8) uniform writeonly image2D picture;
layout(set = 3, binding = 0) uniform texture2D textures[];

const uint no_texture = ~0u;
const float ambient = 0.16;

struct Hit {
    GlintSurfacePoint point;
    vec3 normal;  // with what the normal texture says, on the side of the viewer
    vec3 color;
    float metallic, roughness, distance;
};

vec3 vertexPosition(uint vertex) { return vec3(vertices[vertex * 8u], vertices[vertex * 8u + 1u], vertices[vertex * 8u + 2u]); }
vec3 vertexNormal(uint vertex) { return vec3(vertices[vertex * 8u + 3u], vertices[vertex * 8u + 4u], vertices[vertex * 8u + 5u]); }
vec2 vertexPlace(uint vertex) { return vec2(vertices[vertex * 8u + 6u], vertices[vertex * 8u + 7u]); }

/// The level is chosen by the cone of rays that a pixel stands for (Akenine-Moeller et al., "Texture Level of Detail
/// Strategies for Real-Time Ray Tracing", 2019): `footprint` is the area of a texture, as a part of it, that it meets.
vec4 readTexture(TextureUse use, vec2 place, float footprint, vec4 without) {
    if (use.texture == no_texture) return without;
    const vec2 scaled = place * use.scale;
    const float c = cos(use.rotation), s = sin(use.rotation);
    const vec2 uv = use.offset + vec2(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x);
    const vec2 size = vec2(textureSize(textures[nonuniformEXT(use.texture)], 0));
    const float texels = footprint * abs(use.scale.x * use.scale.y) * size.x * size.y;
    return textureLod(sampler2D(textures[nonuniformEXT(use.texture)], trilinear), uv, 0.5 * log2(max(texels, 1e-12)));
}

#ifdef ALPHA_TEST
/// True if what a candidate hits is there: its alpha, over the cutoff, is 1 or more. The image as it is, no mip level of
/// it: a mean of masks has holes where a leaf is narrow.
bool isSeen(Material material, uint primitive, vec2 barycentrics) {
    const uint corner = material.first_index + 3u * primitive;
    const vec2 place = vertexPlace(indices[corner]) * (1.0 - barycentrics.x - barycentrics.y) +
                       vertexPlace(indices[corner + 1u]) * barycentrics.x +
                       vertexPlace(indices[corner + 2u]) * barycentrics.y;
    return material.base_color.a * readTexture(material.color_use, place, 0.0, vec4(1.0)).a >= 1.0;
}
#endif

/// The nearest hit; false if there is none. `cone`: the width of the pixel's cone where the ray begins.
bool trace(vec3 origin, vec3 direction, float cone, out Hit hit) {
    rayQueryEXT query;
#ifdef ALPHA_TEST
    rayQueryInitializeEXT(query, scene, gl_RayFlagsNoneEXT, 0xff, origin, 0.0, direction, 1e6);
    while (rayQueryProceedEXT(query)) {
        const int first = rayQueryGetIntersectionInstanceCustomIndexEXT(query, false);
        const Material material = materials[first + rayQueryGetIntersectionGeometryIndexEXT(query, false)];
        if (isSeen(material, uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)),
                   rayQueryGetIntersectionBarycentricsEXT(query, false)))
            rayQueryConfirmIntersectionEXT(query);
    }
#else
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, direction, 1e6);
    while (rayQueryProceedEXT(query)) {}
#endif
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return false;

    const Material material = materials[rayQueryGetIntersectionInstanceCustomIndexEXT(query, true) +
                                        rayQueryGetIntersectionGeometryIndexEXT(query, true)];
    const uint corner = material.first_index + 3u * uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    const uvec3 triangle = uvec3(indices[corner], indices[corner + 1u], indices[corner + 2u]);
    const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
    const vec3 a = vertexPosition(triangle.x), b = vertexPosition(triangle.y), c = vertexPosition(triangle.z);
    const vec2 ta = vertexPlace(triangle.x), tb = vertexPlace(triangle.y) - ta, tc = vertexPlace(triangle.z) - ta;
    hit.point = glintSurfacePoint(a, b, c, barycentrics, mat4x3(1.0), mat4x3(1.0));
    hit.distance = rayQueryGetIntersectionTEXT(query, true);

    vec3 normal = glintInterpolate(vertexNormal(triangle.x), vertexNormal(triangle.y), vertexNormal(triangle.z), barycentrics);
    normal = dot(normal, normal) > 0.0 ? normalize(normal) : hit.point.normal;
    normal = glintFaceRay(normal, direction);

    // How much of the texture the cone meets: its section, longer where the ray grazes, in the triangle's parametrisation.
    const float width = cone + pixel_angle * hit.distance;
    const float grazing = max(abs(dot(hit.point.normal, direction)), 0.05);
    const float stretch = abs(tb.x * tc.y - tb.y * tc.x) / max(length(cross(b - a, c - a)), 1e-20);
    const float footprint = stretch * width * width / grazing;
    const vec2 place = ta + tb * barycentrics.x + tc * barycentrics.y;

    const vec4 color = material.base_color * readTexture(material.color_use, place, footprint, vec4(1.0));
    const vec4 surface = readTexture(material.surface_use, place, footprint, vec4(1.0));
    hit.color = color.rgb;
    hit.metallic = material.metallic * surface.b;
    hit.roughness = clamp(material.roughness * surface.g, 0.04, 1.0);

    // The way in which u grows, without a vertex attribute; the bitangent's is against v, which goes down.
    const float side = tb.x * tc.y - tb.y * tc.x;
    hit.normal = normal;
    if (material.normal_use.texture != no_texture && side != 0.0) {
        const vec3 mapped = readTexture(material.normal_use, place, footprint, vec4(0.5, 0.5, 1.0, 0.0)).xyz * 2.0 - 1.0;
        const vec3 along = ((b - a) * tc.y - (c - a) * tb.y) / side;
        const vec3 down = ((c - a) * tb.x - (b - a) * tc.x) / side;
        const vec3 tangent = normalize(along - normal * dot(normal, along));
        const vec3 bitangent = cross(normal, tangent) * (dot(cross(normal, tangent), down) > 0.0 ? -1.0 : 1.0);
        const vec3 bent = tangent * (mapped.x * material.normal_scale) + bitangent * (mapped.y * material.normal_scale) +
                          normal * max(mapped.z, 0.05);
        hit.normal = normalize(bent);
    }
    return true;
}

/// What the surface mirrors straight on.
vec3 mirrored(Hit hit) { return mix(vec3(0.04), hit.color, hit.metallic); }

/// The light's own part.
vec3 shade(Hit hit, vec3 direction) {
    const vec3 way = light.xyz - hit.point.position;
    const vec3 to_light = normalize(way);
    const float fade = 1.0 / (1.0 + dot(way, way) / (light.w * light.w));
    const float facing = glintDiffuse(hit.normal, to_light);
    const float shininess = 2.0 / (hit.roughness * hit.roughness);
    const float glint = facing > 0.0 ? glintPhong(hit.normal, to_light, direction, shininess) : 0.0;
    // A metal has no colour of its own but what it mirrors, of which a rough one shows a mean.
    const vec3 body = hit.color * mix(1.0, 0.35, hit.metallic);
    return body * (ambient + 1.1 * facing * fade) + mirrored(hit) * (glint * fade * (1.0 - 0.7 * hit.roughness) * 2.0);
}

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    const ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    const vec2 at = (vec2(pixel) + 0.5) / vec2(size);
    const vec3 direction = normalize(camera.ray_corner.xyz + camera.ray_x.xyz * at.x + camera.ray_y.xyz * at.y);

    const vec3 outside = vec3(0.05, 0.06, 0.08);
    vec3 color = outside;
    Hit hit;
    if (trace(camera.position.xyz, direction, 0.0, hit)) {
        color = shade(hit, direction);
        const vec3 straight = mirrored(hit);
        const float cosine = clamp(-dot(hit.normal, direction), 0.0, 1.0);
        const float smoothness = 1.0 - hit.roughness;
        const vec3 share = (straight + (1.0 - straight) * pow(1.0 - cosine, 5.0)) * smoothness * smoothness;
        if (reflects != 0u && max(share.r, max(share.g, share.b)) > 1.0 / 255.0) {
            const vec3 onward = glintMirror(direction, hit.normal, glintFaceRay(hit.point.normal, direction));
            Hit seen;
            // A rough surface spreads the cone.
            const float cone = pixel_angle * hit.distance * (1.0 + 8.0 * hit.roughness);
            vec3 other = outside;
            if (trace(glintSpawnPoint(hit.point, onward), onward, cone, seen)) other = shade(seen, onward);
            color += share * other;
        }
    }
    imageStore(picture, pixel, vec4(glintEncodeSrgb(color), 1.0));
}
