// Places along a Z-order curve of 10 bits an axis: keys to sort. Inactive primitives come last. Prepares binary nodes, too.
#pragma once

#include <glint/tracing/build/binary.h>

const uint GLINT_CODE_INACTIVE = 0x3fffffffu;

// Two zero bits between each two of the lower ten.
uvec3 glintSpread(uvec3 x) {
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

void main() {
    const GlintBox bounds = glintBounds();
    const vec3 size = bounds.high - bounds.low;
    const float extent = max(size.x, max(size.y, size.z));
    // Twice the centres, less twice the minimum; the same scale along all axes, so that cells are cubes.
    const float factor = extent > 1e-30 ? 512.0 / extent : 0.0;
    GLINT_FOR(i, build.primitives) {
        const GlintBox box = glintScratchBox(build.boxes + 6u * i);
        uint code = GLINT_CODE_INACTIVE;
        if (!glintIsEmpty(box)) {
            const vec3 place = (box.low - bounds.low + (box.high - bounds.low)) * factor;
            const uvec3 spread = glintSpread(uvec3(clamp(place, 0.0, 1023.0)));
            code = min(spread.x << 2 | spread.y << 1 | spread.z, GLINT_CODE_INACTIVE - 1u);
        }
        scratch[build.keys_out + 2u * i] = code;
        scratch[build.keys_out + 2u * i + 1u] = i;
        scratch[glintBinary(i) + GLINT_BINARY_END] = GLINT_NONE;
    }
}
