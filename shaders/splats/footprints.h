// Projected splats as the passes after the projection read them.
#pragma once

#include <glint/splats/common.h>

layout(std430, binding = 1) readonly buffer Footprints { uvec4 footprints[]; };

Footprint footprintOf(uvec4 first, uvec4 second) {
    return Footprint(uintBitsToFloat(first.xy), uintBitsToFloat(first.z), uintBitsToFloat(first.w),
                     uintBitsToFloat(second.x), uintBitsToFloat(second.y), second.zw);
}

Footprint readFootprint(uint splat) { return footprintOf(footprints[2u * splat], footprints[2u * splat + 1u]); }
