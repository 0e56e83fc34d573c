// Whole numbers of 64 bits from 32-bit ones, for devices without them.
#pragma once

struct Wide {
    uint low;
    int high;
};

Wide wideProduct(int a, int b) {
    int high, low;
    imulExtended(a, b, high, low);
    return Wide(uint(low), high);
}

Wide wideSum(Wide a, Wide b) {
    uint carry;
    const uint low = uaddCarry(a.low, b.low, carry);
    return Wide(low, a.high + b.high + int(carry));
}

// a.x b.y - a.y b.x
Wide wideCross(ivec2 a, ivec2 b) { return wideSum(wideProduct(a.x, b.y), wideProduct(-a.y, b.x)); }

int wideSign(Wide a) { return a.high < 0 ? -1 : (uint(a.high) | a.low) != 0u ? 1 : 0; }

// Rounded once where 32 bits suffice.
float wideFloat(Wide a) {
    if (a.high == int(a.low) >> 31) return float(int(a.low));
    precise float value = float(a.high) * 4294967296.0 + float(a.low);
    return value;
}

// Divided by 256, rounded down, and not beyond 2^30 either way.
int wideUnits(Wide a) {
    const int most = 1 << 30;
    const int value = int(a.low >> 8 | uint(a.high) << 24), rest = a.high >> 8;
    if (rest != value >> 31) return rest < 0 ? -most : most;
    return clamp(value, -most, most);
}
