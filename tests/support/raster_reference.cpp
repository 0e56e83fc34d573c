#include "support/raster_reference.h"

#include <algorithm>
#include <cmath>

namespace glint::test {

namespace {

int64_t cross(const FixedCorner& a, const FixedCorner& b, int64_t x, int64_t y) {
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

/// The part of a polygon where `distance` is not negative.
template <class Distance>
std::vector<Vector4d> cut(const std::vector<Vector4d>& polygon, const Distance& distance) {
    std::vector<Vector4d> kept;
    for (size_t i = 0; i < polygon.size(); i++) {
        const Vector4d& p = polygon[i];
        const Vector4d& q = polygon[(i + 1) % polygon.size()];
        const double at_p = distance(p), at_q = distance(q);
        if (at_p >= 0) kept.push_back(p);
        if ((at_p >= 0) != (at_q >= 0)) kept.push_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
    return kept;
}

}  // namespace

FixedCorner fixedCorner(const Vector3f& p, const Vector2u& size) {
    const float half_x = static_cast<float>(size.x) * 128.0f, half_y = static_cast<float>(size.y) * 128.0f;
    // nearbyint rounds ties to even.
    return {static_cast<int64_t>(std::nearbyint(p.x * half_x)) + size.x * int64_t{128},
            static_cast<int64_t>(std::nearbyint(p.y * -half_y)) + size.y * int64_t{128}, double{p.z}};
}

int areaSign(const FixedTriangle& t) {
    const int64_t area = cross(t[0], t[1], t[2].x, t[2].y);
    return area > 0 ? 1 : area < 0 ? -1 : 0;
}

void forEachPixel(const FixedTriangle& triangle, const Vector2u& size,
                  const std::function<void(uint32_t, uint32_t, double)>& visit) {
    FixedTriangle t = triangle;
    const int sign = areaSign(t);
    if (sign == 0) return;
    if (sign < 0) std::swap(t[1], t[2]);
    const auto [left, right] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [top, bottom] = std::minmax({t[0].y, t[1].y, t[2].y});
    const auto pixel = [](int64_t at, uint32_t count) {
        return static_cast<uint32_t>(std::clamp<int64_t>(at / 256, 0, count));
    };
    const auto area = static_cast<double>(cross(t[0], t[1], t[2].x, t[2].y));
    for (uint32_t y = pixel(top, size.y); y < std::min(pixel(bottom, size.y) + 1, size.y); y++)
        for (uint32_t x = pixel(left, size.x); x < std::min(pixel(right, size.x) + 1, size.x); x++) {
            const int64_t at_x = x * int64_t{256} + 128, at_y = y * int64_t{256} + 128;
            bool is_inside = true;
            std::array<double, 3> weights = {};
            for (int i = 0; i < 3; i++) {
                const FixedCorner& from = t[i];
                const FixedCorner& to = t[(i + 1) % 3];
                const int64_t edge = cross(from, to, at_x, at_y);
                const bool is_top = from.y == to.y && to.x > from.x, is_left = to.y < from.y;
                is_inside = is_inside && (edge > 0 || (edge == 0 && (is_top || is_left)));
                weights[(i + 2) % 3] = static_cast<double>(edge) / area;
            }
            if (is_inside) visit(x, y, weights[0] * t[0].depth + weights[1] * t[1].depth + weights[2] * t[2].depth);
        }
}

std::vector<Vector2d> windowPolygon(const ClipTriangle& triangle, const Vector2u& size) {
    std::vector<Vector4d> polygon(triangle.begin(), triangle.end());
    polygon = cut(polygon, [](const Vector4d& p) { return p.w - p.z; });
    polygon = cut(polygon, [](const Vector4d& p) { return p.z; });
    std::vector<Vector2d> window;
    for (const Vector4d& p : polygon) {
        if (!(p.w > 0)) return {};
        window.emplace_back((0.5 + 0.5 * p.x / p.w) * size.x, (0.5 - 0.5 * p.y / p.w) * size.y);
    }
    return window;
}

ExpectedCounts::ExpectedCounts(const std::vector<ClipTriangle>& triangles, const Vector2u& size, double tolerance)
    : pixels(size_t{size.x} * size.y) {
    for (const ClipTriangle& triangle : triangles) {
        const std::vector<Vector2d> polygon = windowPolygon(triangle, size);
        if (polygon.size() < 3) continue;
        double area = 0.0, left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
        for (size_t i = 0; i < polygon.size(); i++) {
            const Vector2d& p = polygon[i];
            const Vector2d& q = polygon[(i + 1) % polygon.size()];
            area += (p.x - polygon[0].x) * (q.y - polygon[0].y) - (p.y - polygon[0].y) * (q.x - polygon[0].x);
            left = std::min(left, p.x);
            right = std::max(right, p.x);
            top = std::min(top, p.y);
            bottom = std::max(bottom, p.y);
        }
        const int side = area < 0 ? 0 : 1;
        const auto first = [](double at, uint32_t most) {
            return static_cast<uint32_t>(std::clamp(std::floor(at) - 1.0, 0.0, double(most)));
        };
        const auto end = [](double at, uint32_t most) {
            return static_cast<uint32_t>(std::clamp(std::ceil(at) + 1.0, 0.0, double(most)));
        };
        for (uint32_t y = first(top, size.y); y < end(bottom, size.y); y++)
            for (uint32_t x = first(left, size.x); x < end(right, size.x); x++) {
                const Vector2d at(x + 0.5, y + 0.5);
                bool is_inside = false;
                double nearest = 1e30;
                for (size_t i = 0; i < polygon.size(); i++) {
                    const Vector2d p = polygon[i] - at, q = polygon[(i + 1) % polygon.size()] - at, d = q - p;
                    if ((p.y > 0) != (q.y > 0) && p.x - p.y * d.x / d.y < 0) is_inside = !is_inside;
                    const double length = d.x * d.x + d.y * d.y;
                    const double along = length > 0 ? std::clamp(-(p.x * d.x + p.y * d.y) / length, 0.0, 1.0) : 0.0;
                    nearest = std::min(nearest, std::hypot(p.x + along * d.x, p.y + along * d.y));
                }
                Pixel& pixel = pixels[size_t{y} * size.x + x];
                pixel.distance = std::min(pixel.distance, nearest);
                if (is_inside) pixel.inside[side]++;
                if (nearest <= tolerance)
                    // A triangle hardly wider than the tolerance may turn over.
                    for (uint32_t& count : pixel.doubtful) count++;
                else if (is_inside)
                    pixel.sure[side]++;
            }
    }
}

}  // namespace glint::test
