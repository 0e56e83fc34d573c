// Sort keys of floats.
#pragma once

// In the total order of IEEE 754: NaNs with the sign bit, -infinity, negative numbers, -0, +0, positive numbers,
// infinity, NaNs without it. Devices may change the bits of NaNs, and denormals to 0, before they get here.
uint glintSortKey(float value) {
    const uint bits = floatBitsToUint(value);
    return (bits >> 31) != 0u ? ~bits : bits | 0x80000000u;
}

// The float of a key.
float glintSortValue(uint key) { return uintBitsToFloat((key >> 31) != 0u ? key & 0x7fffffffu : ~key); }
