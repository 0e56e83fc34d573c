layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0) uniform Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

// Premultiplied: what light the splats send, and how much of the background they hide.
layout(set = 0, binding = 1) uniform texture2D splats;

layout(set = 0, binding = 2, rgba8) uniform writeonly image2D picture;

/// Lighter where the eye looks down.
vec3 background(vec2 place) {
    vec3 direction = normalize(ray_corner.xyz + ray_x.xyz * place.x + ray_y.xyz * place.y);
    return mix(vec3(0.27, 0.3, 0.35), vec3(0.14, 0.16, 0.2), smoothstep(-0.7, 0.3, direction.z));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 light = texelFetch(splats, pixel, 0);
    // Splats hold colors as they are to be shown.
    vec3 color = light.rgb + (1.0 - light.a) * background((vec2(pixel) + 0.5) / vec2(size));
    imageStore(picture, pixel, vec4(color, 1.0));
}
