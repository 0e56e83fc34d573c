// Numbers of twice a float's digits, 48 bits, as the sum of two floats: for what the host does in float64. Dekker's and
// Knuth's operations; they need rounding to nearest and no fused operations, hence `precise`.
#pragma once

struct GlintTwofold {
    float high;
    float low;
};

GlintTwofold glintTwofold(float x) { return GlintTwofold(x, 0.0); }

// a + b exactly.
GlintTwofold glintExactSum(float a, float b) {
    precise float sum = a + b;
    precise float b_part = sum - a;
    precise float a_part = sum - b_part;
    precise float error = (a - a_part) + (b - b_part);
    return GlintTwofold(sum, error);
}

// a * b exactly, where nothing over- or underflows.
GlintTwofold glintExactProduct(float a, float b) {
    precise float product = a * b;
    precise float split_a = 4097.0 * a;
    precise float split_b = 4097.0 * b;
    precise float a_high = split_a - (split_a - a);
    precise float b_high = split_b - (split_b - b);
    precise float a_low = a - a_high;
    precise float b_low = b - b_high;
    precise float error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return GlintTwofold(product, error);
}

GlintTwofold glintSum(GlintTwofold a, GlintTwofold b) {
    const GlintTwofold high = glintExactSum(a.high, b.high);
    const GlintTwofold low = glintExactSum(a.low, b.low);
    precise float middle = high.low + low.high;
    const GlintTwofold sum = glintExactSum(high.high, middle);
    precise float rest = sum.low + low.low;
    return glintExactSum(sum.high, rest);
}

GlintTwofold glintNegative(GlintTwofold a) { return GlintTwofold(-a.high, -a.low); }

GlintTwofold glintProduct(GlintTwofold a, GlintTwofold b) {
    const GlintTwofold product = glintExactProduct(a.high, b.high);
    precise float rest = product.low + (a.high * b.low + a.low * b.high);
    return glintExactSum(product.high, rest);
}

GlintTwofold glintQuotient(GlintTwofold a, GlintTwofold b) {
    // Each step takes the quotient's error down by 2^-21 at least; division is right to 2.5 ulp.
    GlintTwofold quotient = glintTwofold(a.high / b.high);
    for (int i = 0; i < 2; i++) {
        const GlintTwofold rest = glintSum(a, glintNegative(glintProduct(quotient, b)));
        quotient = glintSum(quotient, glintTwofold(rest.high / b.high));
    }
    return quotient;
}
