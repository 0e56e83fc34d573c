#include <glint/math/ray.h>

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

// Compiled without contraction of products and sums, as `precise` does in GLSL: see CMakeLists.txt.

namespace glint {

namespace {

constexpr float rounding_unit = 0x1p-24f;

/// The columns of a transform, as GLSL's mat4x3 has them.
struct Columns {
    Vector3f c[4];

    explicit Columns(const Transform3x4& transform) {
        for (int column = 0; column < 4; column++)
            for (int row = 0; row < 3; row++) c[column][row] = transform.rows[static_cast<size_t>(4 * row + column)];
    }
    const Vector3f& operator[](int column) const { return c[column]; }
};

float largest(const Vector3f& v) { return std::max(v.x, std::max(v.y, v.z)); }
float sum(const Vector3f& v) { return v.x + v.y + v.z; }
float power(float x) { return std::bit_cast<float>(std::bit_cast<uint32_t>(x) & 0x7f800000u); }
float inversePower(float x) { return std::bit_cast<float>(0x7f000000u - (std::bit_cast<uint32_t>(x) & 0x7f800000u)); }
float dot(const Vector3f& a, const Vector3f& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector3f yzx(const Vector3f& v) { return {v.y, v.z, v.x}; }
Vector3f zxy(const Vector3f& v) { return {v.z, v.x, v.y}; }

Vector3f linear(const Columns& matrix, const Vector3f& v) {
    return matrix[0] * v.x + matrix[1] * v.y + matrix[2] * v.z;
}

Vector3f row(const Vector3f& v, const Columns& matrix) {
    return {dot(v, matrix[0]), dot(v, matrix[1]), dot(v, matrix[2])};
}

Columns absolute(Columns matrix) {
    for (Vector3f& column : matrix.c) column = glm::abs(column);
    return matrix;
}

/// The left 3x3 in units of the power of two of its largest entry.
Columns scaled(Columns matrix) {
    const float scale = inversePower(
        std::max(largest(glm::abs(matrix[0])), std::max(largest(glm::abs(matrix[1])), largest(glm::abs(matrix[2])))));
    for (Vector3f& column : matrix.c) column *= scale;
    return matrix;
}

Vector3f unit(const Vector3f& v) {
    const Vector3f scaled = v * inversePower(largest(glm::abs(v)));
    const float square = dot(scaled, scaled);
    return square > 0.0f && square <= 12.0f ? scaled / std::sqrt(square) : Vector3f(0.0f);
}

Vector3f productError(const Vector3f& a, const Vector3f& b, const Vector3f& product) {
    const Vector3f split_a = 4097.0f * a;
    const Vector3f split_b = 4097.0f * b;
    const Vector3f a_high = split_a - (split_a - a);
    const Vector3f b_high = split_b - (split_b - b);
    const Vector3f a_low = a - a_high;
    const Vector3f b_low = b - b_high;
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

Vector3f cross(const Vector3f& a, const Vector3f& b) {
    const Vector3f first = yzx(a) * zxy(b);
    const Vector3f second = zxy(a) * yzx(b);
    return (first - second) + (productError(yzx(a), zxy(b), first) - productError(zxy(a), yzx(b), second));
}

}  // namespace

SurfacePoint surfacePoint(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector2f& barycentrics,
                          const Transform3x4& to_world, const Transform3x4& to_object) {
    const Columns world(to_world);
    const Columns object(to_object);
    const Vector3f ab = b - a;
    const Vector3f ac = c - a;
    const Vector3f bc = c - b;
    const Vector3f place = a + (ab * barycentrics.x + ac * barycentrics.y);
    SurfacePoint point;
    point.position = linear(world, place) + world[3];
    const Vector3f residual = (linear(object, point.position) + object[3]) - place;

    const float size = std::max(largest(glm::abs(ab)), std::max(largest(glm::abs(ac)), largest(glm::abs(bc))));
    const float scale = inversePower(size);
    const Vector3f unit_ab = ab * scale;
    const Vector3f unit_ac = ac * scale;
    const Vector3f unit_bc = bc * scale;
    const float square_ab = dot(unit_ab, unit_ab);
    const float square_ac = dot(unit_ac, unit_ac);
    const float square_bc = dot(unit_bc, unit_bc);
    const float longest = std::max(square_ab, std::max(square_ac, square_bc));
    const Vector3f first = square_ab == longest ? unit_ac : unit_ab;
    const Vector3f second = square_ab != longest && square_ac != longest ? unit_ac : unit_bc;
    const Vector3f plus = yzx(first) * zxy(second);
    const Vector3f minus = zxy(first) * yzx(second);
    const Vector3f object_normal = plus - minus;
    const Vector3f doubt = (glm::abs(plus) + glm::abs(minus)) * (4.0f * rounding_unit);
    const Vector3f normal = row(object_normal, object);
    const float inverse_power = inversePower(largest(glm::abs(normal)));
    const Vector3f scaled_normal = normal * inverse_power;
    const float square = dot(scaled_normal, scaled_normal);
    if (!(square > 0.0f && square <= 12.0f)) return point;
    const float length = std::sqrt(square);
    point.normal = scaled_normal / length;
    const float inverse_length = inverse_power / length;

    const Vector3f object_weights = (glm::abs(object_normal) + doubt) * inverse_length;
    const Columns object_size = absolute(object);
    const Vector3f weights = row(object_weights, object_size);
    const float doubts = sum(doubt) * inverse_length;
    const float rows = largest(object_size[0] + object_size[1] + object_size[2]);
    const float reach = 2.0f * size;
    const Columns world_size = absolute(world);
    const Vector3f world_reach = (world_size[0] + world_size[1] + world_size[2]) * reach;
    const Vector3f corners = glm::max(glm::abs(a), glm::max(glm::abs(b), glm::abs(c)));
    const Vector3f edges = glm::max(glm::abs(ab), glm::abs(ac));
    const Vector3f object_errors = edges * 3.0f + corners * 5.0f + Vector3f(15.0f * reach);
    const Vector3f world_errors = glm::abs(point.position) * 9.0f + world_size[3] * 8.0f + world_reach * 10.0f;
    const float slenderness = longest * std::sqrt(longest) * inverse_length * power(size);
    const float rounding = dot(object_weights, object_errors) + dot(weights, world_errors) + 8.0f * slenderness;
    const float offset =
        std::abs(dot(object_normal, residual)) * inverse_length + rounding * rounding_unit + doubts * reach;
    point.offset = offset * 1.0078125f;
    const float slope = (16.0f * sum(weights) + 15.0f * sum(object_weights) * rows) * rounding_unit + doubts * rows;
    point.slope = slope * 1.0078125f;
    return point;
}

SurfacePoint surfacePoint(const Vector3f& origin, const Vector3f& direction, float t, const Vector3f& normal,
                          float longest, const Transform3x4& to_world, const Transform3x4& to_object) {
    const Columns world(to_world);
    const Vector3f way = direction * t;
    SurfacePoint point;
    point.position = origin + way;
    point.normal = normal;
    const Columns world_size = absolute(world);
    const Columns object_size = absolute(Columns(to_object));
    const Vector3f object_weights =
        glm::abs(row(normal, world)) + row(glm::abs(normal), world_size) * (4.0f * rounding_unit);
    const Vector3f weights = glm::max(row(object_weights, object_size), glm::abs(normal));
    const float rows = largest(object_size[0] + object_size[1] + object_size[2]);
    const Vector3f world_reach = (world_size[0] + world_size[1] + world_size[2]) * (2.0f * longest);
    const Vector3f world_errors = glm::abs(origin) * 4.0f + glm::abs(way) * 18.0f + glm::abs(point.position) * 6.0f +
                                  world_size[3] * 10.0f + world_reach * 26.0f;
    const float distance = largest(linear(object_size, glm::abs(way)));
    const float object_errors = distance * 15.0f + longest * 141.0f;
    const float rounding = dot(weights, world_errors) + sum(object_weights) * object_errors;
    point.offset = rounding * (rounding_unit * 1.0078125f);
    const float slope = 32.0f * sum(weights) + 15.0f * sum(object_weights) * rows;
    point.slope = slope * (rounding_unit * 1.0078125f);
    return point;
}

Vector3f spawnPoint(const SurfacePoint& point, const Vector3f& direction) {
    const float offset = dot(point.normal, direction) < 0.0f ? -point.offset : point.offset;
    return point.position + point.normal * offset;
}

Segment segment(const SurfacePoint& from, const SurfacePoint& to) {
    const Vector3f between = to.position - from.position;
    SurfacePoint end = to;
    end.offset = to.offset + to.slope * largest(glm::abs(between));
    Segment result;
    result.origin = spawnPoint(from, between);
    result.direction = spawnPoint(end, -between) - result.origin;
    return result;
}

Vector3f transformNormal(const Transform3x4& to_world, const Vector3f& normal) {
    const Columns m = scaled(Columns(to_world));
    Columns cofactors = m;
    for (int i = 0; i < 3; i++) cofactors.c[i] = cross(m[(i + 1) % 3], m[(i + 2) % 3]);
    const Vector3f result = unit(linear(cofactors, unit(normal)));
    return dot(m[0], cofactors[0]) < 0.0f ? -result : result;
}

Vector4f transformTangent(const Transform3x4& to_world, const Vector4f& tangent) {
    const Columns m = scaled(Columns(to_world));
    const float determinant = dot(m[0], cross(m[1], m[2]));
    return {unit(linear(m, unit(Vector3f(tangent)))), determinant < 0.0f ? -tangent.w : tangent.w};
}

Transform3x4 inverse(const Transform3x4& transform) {
    Vector3d columns[4];
    for (int column = 0; column < 4; column++) columns[column] = Vector3d(Columns(transform)[column]);
    const auto crossed = [](const Vector3d& a, const Vector3d& b) {
        return Vector3d(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    };
    const Vector3d rows[3] = {crossed(columns[1], columns[2]), crossed(columns[2], columns[0]),
                              crossed(columns[0], columns[1])};
    const auto product = [](const Vector3d& a, const Vector3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    const double determinant = product(columns[0], rows[0]);
    Transform3x4 result;
    bool finite = determinant != 0.0;
    for (size_t row = 0; row < 3; row++) {
        const Vector3d exact = rows[row] / determinant;
        for (int column = 0; column < 3; column++)
            result.rows[4 * row + static_cast<size_t>(column)] = static_cast<float>(exact[column]);
        result.rows[4 * row + 3] = static_cast<float>(-product(exact, columns[3]));
        for (size_t column = 0; column < 4; column++) finite = finite && std::isfinite(result.rows[4 * row + column]);
    }
    if (!finite) result.rows.fill(std::numeric_limits<float>::quiet_NaN());
    return result;
}

Transform3x4 relativeTransform(const Matrix4x4d& to_world, const Vector3d& eye) {
    Transform3x4 result;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 4; column++) {
            const double entry = column == 3 ? to_world[3][row] - eye[row] : to_world[column][row];
            result.rows[static_cast<size_t>(4 * row + column)] = static_cast<float>(entry);
        }
    }
    return result;
}

}  // namespace glint
