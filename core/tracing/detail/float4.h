#pragma once

// Four floats in a register: boxes as the builders handle them. The fourth lane is along for the ride.

#include <cstdint>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace glint::detail {

#if defined(__SSE2__)

struct Float4 {
    __m128 v;

    static Float4 load(const float* p) { return {_mm_loadu_ps(p)}; }
    /// Three, and 0. By pieces as they were written, if they were just now: a load waits for stores that it spans.
    static Float4 load3(const float* p) {
        const __m128i first = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(p));
        return {_mm_movelh_ps(_mm_castsi128_ps(first), _mm_load_ss(p + 2))};
    }
    static Float4 all(float x) { return {_mm_set1_ps(x)}; }
    void store(float* p) const { _mm_storeu_ps(p, v); }
    friend Float4 operator+(Float4 a, Float4 b) { return {_mm_add_ps(a.v, b.v)}; }
    friend Float4 operator-(Float4 a, Float4 b) { return {_mm_sub_ps(a.v, b.v)}; }
    friend Float4 operator*(Float4 a, Float4 b) { return {_mm_mul_ps(a.v, b.v)}; }
    friend Float4 min(Float4 a, Float4 b) { return {_mm_min_ps(a.v, b.v)}; }
    friend Float4 max(Float4 a, Float4 b) { return {_mm_max_ps(a.v, b.v)}; }
    /// Towards zero; values fit.
    void truncate(int32_t* p) const { _mm_storeu_si128(reinterpret_cast<__m128i*>(p), _mm_cvttps_epi32(v)); }
};

#else

struct Float4 {
    float v[4];

    static Float4 load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
    static Float4 load3(const float* p) { return {{p[0], p[1], p[2], 0.0f}}; }
    static Float4 all(float x) { return {{x, x, x, x}}; }
    void store(float* p) const {
        for (int i = 0; i < 4; i++) p[i] = v[i];
    }
    template <class F>
    static Float4 each(Float4 a, Float4 b, F f) {
        return {{f(a.v[0], b.v[0]), f(a.v[1], b.v[1]), f(a.v[2], b.v[2]), f(a.v[3], b.v[3])}};
    }
    friend Float4 operator+(Float4 a, Float4 b) {
        return each(a, b, [](float x, float y) { return x + y; });
    }
    friend Float4 operator-(Float4 a, Float4 b) {
        return each(a, b, [](float x, float y) { return x - y; });
    }
    friend Float4 operator*(Float4 a, Float4 b) {
        return each(a, b, [](float x, float y) { return x * y; });
    }
    friend Float4 min(Float4 a, Float4 b) {
        return each(a, b, [](float x, float y) { return x < y ? x : y; });
    }
    friend Float4 max(Float4 a, Float4 b) {
        return each(a, b, [](float x, float y) { return x > y ? x : y; });
    }
    void truncate(int32_t* p) const {
        for (int i = 0; i < 3; i++) p[i] = static_cast<int32_t>(v[i]);
        p[3] = 0;
    }
};

#endif

/// A box of primitives on its way: empty until something is added.
struct Box4 {
    Float4 lo = Float4::all(3.402823466e38f);
    Float4 hi = Float4::all(-3.402823466e38f);

    void add(const Box4& box) {
        lo = min(lo, box.lo);
        hi = max(hi, box.hi);
    }
    void add(Float4 point) {
        lo = min(lo, point);
        hi = max(hi, point);
    }
};

/// Half of a box's surface times scale^2; `scale` keeps sizes near 1, so that squares do not overflow.
inline float halfArea(const Box4& box, Float4 scale) {
    float d[4];
    ((box.hi - box.lo) * scale).store(d);
    return d[0] * (d[1] + d[2]) + d[1] * d[2];
}

}  // namespace glint::detail
