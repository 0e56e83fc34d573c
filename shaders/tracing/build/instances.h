// The instances of a top level: their records, and the world's boxes of their hierarchies as primitives. As
// core/tracing/instances.cpp does it in float64.
#pragma once

#define GLINT_BUILD_HEAP 1
#define GLINT_BUILD_INPUT 2
#include <glint/tracing/build/bounds.h>
#include <glint/tracing/build/input.h>
#include <glint/tracing/build/twofold.h>

struct GlintMatrix {
    float at[12];  // rows of 3x4
};

// False if there is no inverse. Rows are brought near 1 by powers of two first, so that products keep within range;
// the inverse's columns are brought back by them.
bool glintInvert(GlintMatrix m, out GlintMatrix inverse) {
    float back[3];
    bool usable = true;
    for (uint row = 0u; row < 3u; row++) {
        const float size = max(max(abs(m.at[4u * row]), abs(m.at[4u * row + 1u])), abs(m.at[4u * row + 2u]));
        const uint exponent = clamp(floatBitsToUint(size) >> 23, 1u, 253u);
        back[row] = uintBitsToFloat((254u - exponent) << 23);
        for (uint column = 0u; column < 3u; column++) m.at[4u * row + column] *= back[row];
    }
    GlintTwofold cofactors[9];
    for (uint row = 0u; row < 3u; row++) {
        for (uint column = 0u; column < 3u; column++) {
            const uint r1 = (column + 1u) % 3u;
            const uint r2 = (column + 2u) % 3u;
            const uint c1 = (row + 1u) % 3u;
            const uint c2 = (row + 2u) % 3u;
            cofactors[3u * row + column] =
                glintSum(glintExactProduct(m.at[4u * r1 + c1], m.at[4u * r2 + c2]),
                         glintNegative(glintExactProduct(m.at[4u * r1 + c2], m.at[4u * r2 + c1])));
        }
    }
    GlintTwofold determinant = glintTwofold(0.0);
    for (uint i = 0u; i < 3u; i++)
        determinant = glintSum(determinant, glintProduct(glintTwofold(m.at[i]), cofactors[3u * i]));
    if (determinant.high == 0.0) return false;
    for (uint row = 0u; row < 3u; row++) {
        GlintTwofold moved = glintTwofold(0.0);
        for (uint column = 0u; column < 3u; column++) {
            GlintTwofold value = glintQuotient(cofactors[3u * row + column], determinant);
            value = GlintTwofold(value.high * back[column], value.low * back[column]);
            inverse.at[4u * row + column] = value.high;
            moved = glintSum(moved, glintNegative(glintProduct(value, glintTwofold(m.at[4u * column + 3u]))));
        }
        inverse.at[4u * row + 3u] = moved.high;
    }
    for (uint i = 0u; i < 12u; i++) usable = usable && (floatBitsToUint(inverse.at[i]) & 0x7fffffffu) < 0x7f800000u;
    return usable;
}

// The box of a transformed box, outward rounded. u = 2^-24: a product is off by u of itself, the three sums by u each of
// no more than 1 + 4 u times the size, and so is what is added at the end: less than 6 u of the size. Half as much again
// is added, and what products lose that underflow.
GlintBox glintWorldBox(GlintMatrix m, GlintBox box) {
    GlintBox world;
    for (uint row = 0u; row < 3u; row++) {
        float low = m.at[4u * row + 3u];
        float high = low;
        float size = abs(low);
        for (uint column = 0u; column < 3u; column++) {
            const float a = m.at[4u * row + column] * box.low[column];
            const float b = m.at[4u * row + column] * box.high[column];
            low += min(a, b);
            high += max(a, b);
            size += max(abs(a), abs(b));
        }
        const float margin = size * 5.3644180e-7 + 1e-36;  // 9 u
        world.low[row] = low - margin;
        world.high[row] = high + margin;
    }
    return world;
}

void main() {
    const uint from_header = GLINT_TRACING_LOAD(build.hierarchy + 3u).w;
    const uint first = build.hierarchy + (build.instances != 0u ? build.instances : from_header);
    GlintBox all_boxes = GLINT_EMPTY;
    uint present = 0u;
    GLINT_FOR(i, build.count) {
        const uint word = build.data + i * build.stride;
        GlintMatrix to_world;
        bool usable = true;
        for (uint k = 0u; k < 12u; k++) {
            const uint bits = data[word + k];
            to_world.at[k] = uintBitsToFloat(bits);
            usable = usable && (bits & 0x7fffffffu) < 0x7f800000u;
        }
        GlintMatrix to_object;
        for (uint k = 0u; k < 12u; k++) to_object.at[k] = 0.0;
        const uint hierarchy = data[word + 12u];
        GlintBox box = GLINT_EMPTY;
        if (usable && hierarchy != GLINT_NONE && glintInvert(to_world, to_object)) {
            box.low = uintBitsToFloat(GLINT_TRACING_LOAD(hierarchy + 2u).xyz);
            box.high = uintBitsToFloat(GLINT_TRACING_LOAD(hierarchy + 3u).xyz);
            if (!glintIsEmpty(box)) box = glintWorldBox(to_world, box);
            if (!glintIsEmpty(box) && !(glintInRange(box.low) && glintInRange(box.high))) box = GLINT_EMPTY;
        }
        if (!glintIsEmpty(box)) {
            all_boxes = glintJoin(all_boxes, box);
            present++;
        }
        glintSetScratchBox(build.boxes + 6u * i, box);
        const uint texel = first + 8u * i;
        for (uint k = 0u; k < 3u; k++) {
            GLINT_TRACING_STORE(texel + k, uvec4(data[word + 4u * k], data[word + 4u * k + 1u],
                                                 data[word + 4u * k + 2u], data[word + 4u * k + 3u]));
            GLINT_TRACING_STORE(texel + 3u + k,
                                floatBitsToUint(vec4(to_object.at[4u * k], to_object.at[4u * k + 1u],
                                                     to_object.at[4u * k + 2u], to_object.at[4u * k + 3u])));
        }
        GLINT_TRACING_STORE(texel + 6u, uvec4(hierarchy, data[word + 13u], data[word + 14u], 0u));
        GLINT_TRACING_STORE(texel + 7u, uvec4(0u));
    }
    glintAddBounds(all_boxes, present);
}
