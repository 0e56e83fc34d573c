// What the visibility buffer of Rasterizer holds, and what shading after it needs: #include <glint/raster/visibility.h>.
//
//     layout(std430, binding = 0) readonly buffer Visibility { uvec2 visibility[]; };
//     ...
//     const uvec2 pixel = visibility[at.y * size.x + at.x];
//     if (!isVisible(pixel)) ...  // background
//     const Barycentrics at_pixel = barycentrics(clip_a, clip_b, clip_c, vec2(at) + 0.5, vec2(size));
//     const vec3 normal = at_pixel.weights.x * normal_a + at_pixel.weights.y * normal_b + at_pixel.weights.z * normal_c;
#pragma once

bool isVisible(uvec2 pixel) { return pixel.y != 0u; }

// z / w of clip space: larger is nearer, 0 the background.
float visibleDepth(uvec2 pixel) { return uintBitsToFloat(pixel.y); }

// The triangle's number; 0xffffffff without one.
uint visibleTriangle(uvec2 pixel) { return ~pixel.x; }

// That of a draw of clusters: instance, cluster, triangle of the cluster.
uvec3 visibleCluster(uvec2 pixel, uint cluster_count) {
    const uint id = ~pixel.x;
    return uvec3(id / 128u / cluster_count, id / 128u % cluster_count, id % 128u);
}

// Weights of a triangle's corners at a place of the picture, correct in perspective: their sum is 1. Derivatives from
// pixel to pixel, to the right and down.
struct Barycentrics {
    vec3 weights;
    vec3 along_x, along_y;
};

// `a`, `b`, `c`: the corners in clip space, also behind the eye. `at`: pixels from the top left corner of a picture of
// this size; centres are at 0.5. Of a triangle seen from its edge: thirds.
Barycentrics barycentrics(vec4 a, vec4 b, vec4 c, vec2 at, vec2 size) {
    // Seen from the place itself, so that differences of large numbers come first.
    const vec2 unit = vec2(2.0, -2.0) / size, ndc = at * unit + vec2(-1.0, 1.0);
    const vec2 p = a.xy - ndc * a.w, q = b.xy - ndc * b.w, r = c.xy - ndc * c.w;
    const vec3 edges = vec3(q.x * r.y - q.y * r.x, r.x * p.y - r.y * p.x, p.x * q.y - p.y * q.x);
    const float sum = edges.x + edges.y + edges.z;
    Barycentrics result;
    if (sum == 0.0) {
        result.weights = vec3(1.0 / 3.0);
        result.along_x = result.along_y = vec3(0.0);
        return result;
    }
    result.weights = edges / sum;
    const vec3 edges_x = unit.x * vec3(q.y * c.w - r.y * b.w, r.y * a.w - p.y * c.w, p.y * b.w - q.y * a.w);
    const vec3 edges_y = unit.y * vec3(r.x * b.w - q.x * c.w, p.x * c.w - r.x * a.w, q.x * a.w - p.x * b.w);
    result.along_x = (edges_x - result.weights * (edges_x.x + edges_x.y + edges_x.z)) / sum;
    result.along_y = (edges_y - result.weights * (edges_y.x + edges_y.y + edges_y.z)) / sum;
    return result;
}
