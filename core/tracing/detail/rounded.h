#pragma once

// Floats on the stated side of a number.

#include <cmath>
#include <limits>

namespace glint::detail {

inline float roundedDown(double x) {
    // Volatile, as GCC 12 may leave out the rounding in a vectorised double(float(x)).
    const volatile float stored = static_cast<float>(x);
    const float f = stored;
    return f > x ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}

inline float roundedUp(double x) { return -roundedDown(-x); }

/// Not above a - b, and one float below it at most where that is no float itself.
inline float differenceDown(float a, float b) {
    const double difference = double(a) - double(b);
    // What rounding took away (Knuth's two-sum).
    const double part = difference - double(a);
    const double error = (double(a) - (difference - part)) - (double(b) + part);
    return roundedDown(error < 0.0 ? std::nextafter(difference, -std::numeric_limits<double>::infinity()) : difference);
}

inline float differenceUp(float a, float b) { return -differenceDown(b, a); }

}  // namespace glint::detail
