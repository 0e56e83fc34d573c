// Pairs of floats whose sum is a number of about 48 bits: Dekker, "A floating-point technique for extending the
// available precision", 1971. The second is at most half a unit in the last place of the first.
#pragma once

vec2 pairOf(float high, float low) {
    precise float sum = high + low;
    precise float rest = low - (sum - high);
    return vec2(sum, rest);
}

vec2 pairSum(vec2 a, vec2 b) {
    precise float sum = a.x + b.x;
    precise float part = sum - a.x;
    precise float rest = (a.x - (sum - part)) + (b.x - part) + (a.y + b.y);
    return pairOf(sum, rest);
}

vec2 pairProduct(vec2 a, vec2 b) {
    // 12 bits each.
    precise float split_a = 4097.0 * a.x, split_b = 4097.0 * b.x;
    precise float high_a = split_a - (split_a - a.x), high_b = split_b - (split_b - b.x);
    precise float low_a = a.x - high_a, low_b = b.x - high_b;
    precise float product = a.x * b.x;
    precise float rest = ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b;
    precise float all = rest + (a.x * b.y + a.y * b.x);
    return pairOf(product, all);
}

vec2 pairQuotient(vec2 a, vec2 b) {
    precise float quotient = a.x / b.x;
    const vec2 left = pairSum(a, -pairProduct(vec2(quotient, 0.0), b));
    precise float rest = left.x / b.x;
    return pairOf(quotient, rest);
}
