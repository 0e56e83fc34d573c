#pragma once

// Secondary rays against float64: acne, leaks, and contacts that are lost.

#include "support/reference_hierarchy.h"
#include "support/secondary_rays.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

struct SecondaryCount {
    uint64_t rays = 0;
    /// Rays that meet the triangle they leave, or one that docs/rays.md promises they do not: flat and convex
    /// neighbours.
    uint64_t acne = 0;
    uint64_t strays = 0;  ///< other rays that meet what the exact ray stays clear of
    uint64_t sure = 0;    ///< rays that have to meet something, whatever rounding within the bounds does
    uint64_t leaks = 0;   ///< of those, rays that did not, or met only what lies behind
    /// Rays that meet another triangle by float64, however near it is, and those of them that did not, or met only what
    /// lies behind. A ray that starts beyond what is nearer than its offset is one of these, and no leak.
    uint64_t blocked = 0;
    uint64_t lost = 0;
    std::string first;  ///< acne, stray or leak

    SecondaryCount& operator+=(const SecondaryCount& other);
};

/// The exact ray begins on the triangle, where the barycentrics of the primary hit say; it ends at the lamp, or goes
/// the mirrored way. Instances are where the inverse transforms A that the engine reports put them: what an engine
/// makes of a transform moves an instance as a whole, and is tested in accuracy/instances_test.cpp. With s the spawn
/// point of the derived offset, x the exact beginning, p the transform's translation, l the ray from its beginning to
/// its end and R the largest distance of a corner from s in object space, the ray that the engine traces stays within
///
///     |A (s - x)| + u | |A| (4 |s| + 6 |p| + 20 |l|) | + 16 u R
///
/// of the exact one, in object space: the `margin`. (docs/rays.md, "Why", 1: the way to object space. 4: its direction,
/// 3 u; with the rounding of a segment's, and the 16 u by which segments end early, 20 u. docs/accuracy.md: the
/// triangle test, 16 u R.) It does not depend on how the rays that are judged did start.
///
/// A ray stays clear of a triangle that is further than the margin from all of it. It has to meet one that it crosses
/// further than the margin from the border, with both of its ends further than the margin from the plane: no ray with
/// ends within the margin of those can get past the border without coming within the margin of it.
class SecondaryJudge {
public:
    /// Of results whose primary hits are those of all that will be judged; they see every instance. Keeps a reference
    /// to the case.
    SecondaryJudge(const SecondaryCase& scene, std::span<const SecondarySample> samples,
                   std::span<const SecondaryResult> results);

    struct Counts {
        SecondaryCount shadow, mirror;
    };
    /// Throws std::runtime_error if the primary hits are others, or a hit names what is not there.
    Counts count(std::span<const SecondaryResult> results) const;

private:
    struct Place {
        Matrix4x4d to_world = Matrix4x4d(0.0);
        Matrix4x4d to_object = Matrix4x4d(0.0);
        Vector3d translation = Vector3d(0.0);
    };
    struct Surface {
        uint32_t instance = SecondaryResult::none, triangle = 0;
        double t = 0.0;          ///< in lengths of the ray
        double tolerance = 0.0;  ///< of t
        bool exists() const { return instance != SecondaryResult::none; }
    };
    struct Path {
        Vector3d from, to;  ///< the exact ray, in the world
        Vector3d start;     ///< with the derived offset
        Surface own;
        double climb = 0.0;  ///< height that it gains over the plane, for each unit of its largest component
        double slope = 0.0;
        double side = 1.0;  ///< -1 where it goes to the side from which the corners are clockwise
        Surface exact, sure;
    };

    void check(uint32_t triangle, uint32_t instance) const;
    Path pathOf(const SecondaryResult& result, const Vector3f& direction, const Vector3f* lamp) const;
    double margin(const Path& path, const Surface& surface) const;
    double tolerance(const Path& path, const Surface& surface) const;
    bool isPromised(const Path& path, const Surface& surface) const;
    void judge(const Path& path, Surface met, bool any, SecondaryCount& count, size_t ray) const;

    const SecondaryCase& scene_;
    ReferenceHierarchy reference_;
    std::vector<Place> places_;
    std::vector<SecondaryResult> primary_;
    std::vector<Path> shadows_, mirrors_;
};

}  // namespace glint::test
