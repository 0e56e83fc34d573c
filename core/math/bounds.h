#pragma once

#include <glint/math/math.h>

#include <limits>
#include <span>

namespace glint {

/// An axis-aligned box, closed on all sides. Empty until something is added.
struct BoundBox {
    Vector3f min = Vector3f(std::numeric_limits<float>::infinity());
    Vector3f max = Vector3f(-std::numeric_limits<float>::infinity());

    BoundBox() = default;
    BoundBox(const Vector3f& min_, const Vector3f& max_) : min(min_), max(max_) {}
    explicit BoundBox(std::span<const Vector3f> points);

    /// Grows the box to hold the point. Returns false, and leaves the box as it was, if a coordinate is NaN or
    /// infinite.
    bool add(const Vector3f& point);
    void add(const BoundBox& box);

    /// True unless min <= max along every axis; so a box with a NaN in it is empty.
    bool isEmpty() const;
    bool contains(const Vector3f& point) const;
    /// Zero for an empty box.
    Vector3f center() const;
    /// Length of the sides; zero for an empty box.
    Vector3f size() const;

    bool operator==(const BoundBox&) const = default;
};

/// A ball. Empty until made from points: a negative radius.
struct BoundSphere {
    Vector3f center = Vector3f(0.0f);
    float radius = -1.0f;

    BoundSphere() = default;
    /// Holds every finite point, rounding included (distances are taken in float64 and rounded up); points that are not
    /// finite are left out. Centred on the points' box, so its radius is at most sqrt(3) times the least one.
    explicit BoundSphere(std::span<const Vector3f> points);

    bool isEmpty() const { return !(radius >= 0.0f); }
};

}  // namespace glint
