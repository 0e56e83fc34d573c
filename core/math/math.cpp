#include <glint/math/math.h>

namespace glint {

namespace {

struct SinCos {
    float sin = 0.0f;
    float cos = 1.0f;
};

// Through double, so that multiples of 90 degrees come out as 0 and 1 after rounding to float's 1e-8 or better.
SinCos sinCos(float degrees) {
    const double angle = static_cast<double>(degrees) * (3.14159265358979323846 / 180.0);
    return {static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle))};
}

}  // namespace

Matrix4x4f rotateX(float degrees) {
    const SinCos r = sinCos(degrees);
    return Matrix4x4f(1, 0, 0, 0, 0, r.cos, r.sin, 0, 0, -r.sin, r.cos, 0, 0, 0, 0, 1);
}

Matrix4x4f rotateY(float degrees) {
    const SinCos r = sinCos(degrees);
    return Matrix4x4f(r.cos, 0, -r.sin, 0, 0, 1, 0, 0, r.sin, 0, r.cos, 0, 0, 0, 0, 1);
}

Matrix4x4f rotateZ(float degrees) {
    const SinCos r = sinCos(degrees);
    return Matrix4x4f(r.cos, r.sin, 0, 0, -r.sin, r.cos, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
}

Matrix4x4f translate(const Vector3f& offset) {
    return Matrix4x4f(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, offset.x, offset.y, offset.z, 1);
}

Matrix4x4f scale(const Vector3f& factors) {
    return Matrix4x4f(factors.x, 0, 0, 0, 0, factors.y, 0, 0, 0, 0, factors.z, 0, 0, 0, 0, 1);
}

Transform3x4::Transform3x4(const Matrix4x4f& matrix) {
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) rows[static_cast<size_t>(row * 4 + column)] = matrix[column][row];
}

Matrix4x4f Transform3x4::matrix() const {
    Matrix4x4f matrix(1.0f);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) matrix[column][row] = rows[static_cast<size_t>(row * 4 + column)];
    return matrix;
}

}  // namespace glint
