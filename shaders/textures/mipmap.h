// One level of mip levels from the level below it: the mean of what each texel covers. Run by Compute::createMipmaps,
// which says with macros what the format is (core/device/detail/mipmaps.cpp):
//
// GLINT_KIND: how a channel is stored, below. GLINT_CHANNELS, GLINT_BITS: of a texel, of a channel.
// GLINT_FLOATS 1: reads the level below as the pass before has kept it; 0: as it is stored in the texture.
// GLINT_VOLUME 1: filters along z; 0: z counts layers. GLINT_EVEN 1: no size below is odd, but for 1.
#pragma once

#define GLINT_UNORM 0
#define GLINT_SNORM 1
#define GLINT_SRGB 2   // the first three channels
#define GLINT_BGRA 3   // 8 bits, blue first
#define GLINT_SBGRA 4  // the same as sRGB
#define GLINT_HALF 5
#define GLINT_FLOAT 6
#define GLINT_RGB10A2 7
#define GLINT_RG11B10 8
#define GLINT_RGB9E5 9

#if GLINT_CHANNELS == 1
#define GLINT_TEXEL float
#define GLINT_PART(value) (value).x
#elif GLINT_CHANNELS == 2
#define GLINT_TEXEL vec2
#define GLINT_PART(value) (value).xy
#else
#define GLINT_TEXEL vec4
#define GLINT_PART(value) (value)
#endif

// Below 32 bits a thread makes the texels of a word, else a texel.
#define GLINT_PACKED (GLINT_CHANNELS * GLINT_BITS < 32)
#if GLINT_PACKED
layout(local_size_x = 64) in;
#else
layout(local_size_x = 16, local_size_y = 4) in;
#endif

layout(push_constant) uniform Pass {
    uvec3 below;       // texels of the level below, along z those of a volume
    uint first_row;    // of the box that the pass makes
    uvec3 size;        // likewise of the level
    uint first_slice;  // z, or layer
    uint rows;
    uint slices;
    uint keep;  // 1: for the next level
} level;

#if GLINT_FLOATS
layout(std430, binding = 0) readonly buffer Below { GLINT_TEXEL texels[]; } source;
#elif GLINT_VOLUME
layout(binding = 0) uniform texture3D source;
#else
layout(binding = 0) uniform texture2DArray source;
#endif
layout(std430, binding = 1) writeonly buffer Kept { GLINT_TEXEL texels[]; } kept;
layout(std430, binding = 2) writeonly buffer Stored { uint words[]; } stored;

float encodeSrgb(float value) {
    return value <= 0.0031308 ? 12.92 * value : 1.055 * pow(value, 1.0 / 2.4) - 0.055;
}

// What the device has read, if it decodes to less than half a unit: lavapipe is a quarter of one off.
float decodedSrgb(float value) {
    const float stored = floor(encodeSrgb(value) * 255.0 + 0.5) / 255.0;
    return stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4);
}

vec4 read(uvec3 p) {
#if GLINT_FLOATS
    const GLINT_TEXEL value = source.texels[((p.z - level.first_slice) * level.below.y + p.y) * level.below.x + p.x];
#if GLINT_CHANNELS == 1
    return vec4(value, 0.0, 0.0, 1.0);
#elif GLINT_CHANNELS == 2
    return vec4(value, 0.0, 1.0);
#else
    return value;
#endif
#else
    vec4 value = texelFetch(source, ivec3(p), 0);
#if GLINT_KIND == GLINT_SRGB || GLINT_KIND == GLINT_SBGRA
    for (uint channel = 0u; channel < 3u; channel++) value[channel] = decodedSrgb(value[channel]);
#endif
    return value;
#endif
}

#if GLINT_EVEN

// Halved first, so that no sum overflows; `precise`, so that it stays first.
vec4 middle(vec4 a, vec4 b) {
    precise vec4 result = 0.5 * a + 0.5 * b;
    return result;
}

vec4 rowMean(uvec3 p, uint right) { return middle(read(p), read(uvec3(right, p.y, p.z))); }

vec4 planeMean(uvec3 p, uint right, uint lower) {
    return middle(rowMean(p, right), rowMean(uvec3(p.x, lower, p.z), right));
}

vec4 mean(uvec3 p) {
    // Of a size of 1 the one texel counts twice, which changes nothing.
    const uint left = min(2u * p.x, level.below.x - 1u), right = min(left + 1u, level.below.x - 1u);
    const uint upper = min(2u * p.y, level.below.y - 1u), lower = min(upper + 1u, level.below.y - 1u);
#if GLINT_VOLUME
    const uint front = min(2u * p.z, level.below.z - 1u), back = min(front + 1u, level.below.z - 1u);
    return middle(planeMean(uvec3(left, upper, front), right, lower),
                  planeMean(uvec3(left, upper, back), right, lower));
#else
    return planeMean(uvec3(left, upper, p.z), right, lower);
#endif
}

#else

// The texels below that texel i covers along an axis, and how much of them. 2n + 1 texels become n: each covers
// 2 + 1 / n of them, of which one at least is whole.
struct Cover {
    uint first;
    uint count;
    vec3 weights;
};

Cover cover(uint i, uint size, uint below) {
    if (below == 1u) return Cover(0u, 1u, vec3(1.0));
    if ((below & 1u) == 0u) return Cover(2u * i, 2u, vec3(0.5));
    return Cover(2u * i, 3u, vec3(size - i, size, i + 1u) / float(below));
}

float weight(Cover c, uint k) { return k == 0u ? c.weights.x : k == 1u ? c.weights.y : c.weights.z; }

vec4 mean(uvec3 p) {
    const Cover x = cover(p.x, level.size.x, level.below.x);
    const Cover y = cover(p.y, level.size.y, level.below.y);
#if GLINT_VOLUME
    const Cover z = cover(p.z, level.size.z, level.below.z);
#else
    const Cover z = Cover(p.z, 1u, vec3(1.0));
#endif
    vec4 sum = vec4(0.0);
    for (uint k = 0u; k < z.count; k++)
        for (uint j = 0u; j < y.count; j++)
            for (uint i = 0u; i < x.count; i++)
                sum += weight(z, k) * weight(y, j) * weight(x, i) *
                       read(uvec3(x.first + i, y.first + j, z.first + k));
    return sum;
}

#endif

uint unorm(float value, uint bits) {
    const float most = float((1u << bits) - 1u);
    return uint(clamp(value, 0.0, 1.0) * most + 0.5);
}

// A float of 5 bits of exponent and this many of mantissa, no sign, to the nearest, ties to even: what packHalf2x16
// leaves open.
uint smallFloat(float value, uint mantissa) {
    const uint bits = floatBitsToUint(value) & 0x7fffffffu;
    const uint infinity = 31u << mantissa;
    if (bits >= 0x7f800000u) return bits > 0x7f800000u ? infinity + 1u : infinity;
    // Below 2^-14 steps are all alike; multiplying by a power of two is exact.
    if (bits < 0x38800000u) return uint(roundEven(abs(value) * float(1u << (14u + mantissa))));
    const uint shift = 23u - mantissa;
    return min((bits + (1u << (shift - 1u)) - 1u + (bits >> shift & 1u) - 0x38000000u) >> shift, infinity);
}

uint positiveFloat(float value, uint mantissa) { return value < 0.0 ? 0u : smallFloat(value, mantissa); }

// Vulkan 1.3, section "Conversion to shared exponent": the exponent of the largest channel, one more if its mantissa
// rounds up to 2^9.
uint sharedExponent(vec3 color) {
    color = clamp(color, vec3(0.0), vec3(65408.0));
    const float most = max(color.x, max(color.y, color.z));
    int exponent = max(int(floatBitsToUint(most) >> 23) - 127, -16) + 16;
    if (floor(ldexp(most, 24 - exponent) + 0.5) >= 512.0) exponent++;
    const uvec3 mantissas = uvec3(floor(ldexp(color, ivec3(24 - exponent)) + 0.5));
    return mantissas.x | mantissas.y << 9 | mantissas.z << 18 | uint(exponent) << 27;
}

// The bits of one channel.
uint encode(float value, uint channel) {
#if GLINT_KIND == GLINT_SNORM
    const float most = float((1u << (GLINT_BITS - 1)) - 1u);
    return uint(int(floor(clamp(value, -1.0, 1.0) * most + 0.5))) & ((1u << GLINT_BITS) - 1u);
#elif GLINT_KIND == GLINT_HALF
    return smallFloat(value, 10u) | (floatBitsToUint(value) >> 16 & 0x8000u);
#elif GLINT_KIND == GLINT_FLOAT
    return floatBitsToUint(value);
#else
#if GLINT_KIND == GLINT_SRGB || GLINT_KIND == GLINT_SBGRA
    if (channel < 3u) value = encodeSrgb(value);
#endif
    return unorm(value, GLINT_BITS);
#endif
}

#if GLINT_PACKED

void main() {
    const uint words_a_row = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    const uint word = gl_GlobalInvocationID.y * words_a_row + gl_GlobalInvocationID.x;
    const uint texels = level.size.x * level.rows * level.slices;
    const uint a_word = 32 / (GLINT_CHANNELS * GLINT_BITS);
    if (word * a_word >= texels) return;
    uint bits = 0u;
    for (uint i = 0u; i < a_word; i++) {
        const uint texel = word * a_word + i;
        if (texel >= texels) break;
        const uint row = texel / level.size.x;
        const uint slice = row / level.rows;
        const vec4 value = mean(uvec3(texel - row * level.size.x, level.first_row + row - slice * level.rows,
                                      level.first_slice + slice));
        if (level.keep != 0u) kept.texels[texel] = GLINT_PART(value);
        for (uint channel = 0u; channel < GLINT_CHANNELS; channel++)
            bits |= encode(value[channel], channel) << (GLINT_BITS * (i * GLINT_CHANNELS + channel));
    }
    stored.words[word] = bits;
}

#else

void store(uint texel, vec4 value) {
#if GLINT_KIND == GLINT_RGB10A2
    stored.words[texel] = unorm(value.r, 10u) | unorm(value.g, 10u) << 10 | unorm(value.b, 10u) << 20 |
                          unorm(value.a, 2u) << 30;
#elif GLINT_KIND == GLINT_RG11B10
    stored.words[texel] = positiveFloat(value.r, 6u) | positiveFloat(value.g, 6u) << 11 |
                          positiveFloat(value.b, 5u) << 22;
#elif GLINT_KIND == GLINT_RGB9E5
    stored.words[texel] = sharedExponent(value.rgb);
#else
    const uvec4 bits = uvec4(encode(value.r, 0u), encode(value.g, 1u), encode(value.b, 2u), encode(value.a, 3u));
#if GLINT_BITS == 8
#if GLINT_KIND == GLINT_BGRA || GLINT_KIND == GLINT_SBGRA
    stored.words[texel] = bits.b | bits.g << 8 | bits.r << 16 | bits.a << 24;
#else
    stored.words[texel] = bits.r | bits.g << 8 | bits.b << 16 | bits.a << 24;
#endif
#elif GLINT_BITS == 16
    const uint words = GLINT_CHANNELS / 2;
    stored.words[texel * words] = bits.r | bits.g << 16;
    if (words == 2u) stored.words[texel * words + 1u] = bits.b | bits.a << 16;
#else
    for (uint channel = 0u; channel < GLINT_CHANNELS; channel++)
        stored.words[texel * GLINT_CHANNELS + channel] = bits[channel];
#endif
#endif
}

void main() {
    const uvec3 id = gl_GlobalInvocationID;
    if (id.x >= level.size.x || id.y >= level.rows || id.z >= level.slices) return;
    const vec4 value = mean(uvec3(id.x, level.first_row + id.y, level.first_slice + id.z));
    const uint texel = (id.z * level.rows + id.y) * level.size.x + id.x;
    if (level.keep != 0u) kept.texels[texel] = GLINT_PART(value);
    store(texel, value);
}

#endif
