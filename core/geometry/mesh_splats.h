#pragma once

#include <glint/base/expected.h>
#include <glint/format/mesh.h>
#include <glint/format/splats.h>
#include <glint/math/ray.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace glint {

/// Says of each ray whether anything lies on it: 1, or 0; as RayCaster::castAny does.
using OcclusionTest = std::function<Expected<std::vector<uint8_t>>(std::span<const Ray> rays)>;

/// The light of splatsFromMesh: a lamp far away and a sky. Colors are linear, in any unit in which 1 is what the
/// picture shows as white.
struct SplatLight {
    Vector3f up = {0, 0, 1};                 ///< towards the middle of the sky; of any length but 0
    Vector3f direction = {0.5f, -0.6f, 1};   ///< towards the lamp; of any length but 0
    float radius = 2.0f;                     ///< of the lamp's disc, degrees from 0 to 45: how soft shadows are
    Vector3f lamp = {1.5f, 1.38f, 1.2f};     ///< what a white surface sends on that faces the lamp
    Vector3f sky = {0.24f, 0.3f, 0.4f};      ///< what comes from straight above
    Vector3f ground = {0.1f, 0.08f, 0.07f};  ///< what comes from below, if nothing is in the way
};

/// How splatsFromMesh covers and lights a mesh.
struct MeshSplatsOptions {
    uint32_t count = 200'000;  ///< splats, 1 to max_surface_samples
    uint32_t degree = 3;       ///< of the harmonics, 0 to 3: how much the highlights may depend on the view
    /// Share of the light that the surface reflects, at a point of it: linear, 0 to 1. Empty: (0.6, 0.6, 0.6).
    std::function<Vector3f(const Vector3f& position)> color;
    float gloss = 0.15f;  ///< share of the light that the surface mirrors where it is faced, 0 to 1
    SplatLight light;
    uint32_t lamp_rays = 4;  ///< rays from each splat to the lamp, 1 to 64
    uint32_t sky_rays = 48;  ///< and to the sky, 1 to 1024
};

/// Splats that look like a mesh under a light.
///
/// Discs lie on points of sampleSurface, along the mesh's normals (those of its triangles where it has none), but no
/// farther than 25 degrees from their triangle. Their standard deviation is 0.75 of the distance to their neighbours, a
/// tenth of that across the surface, their opacity 0.98, so that they close it: seen along its normal, at most 2
/// percent of what is behind shines through. At sharp edges discs reach over the edge.
///
/// Colors are of the lamp and of the sky, as far as `occlusion` lets their light arrive, on a diffuse surface with a
/// gloss (Blinn and Phong's lobe, Schlick's Fresnel); raised to 1 / 2.2, as they are to be shown; and then fitted by
/// harmonics, on the directions from which a splat can be seen and a little beyond; the rest count a hundredth (see
/// HarmonicsFit). A fit is 0.023 from the color at the default gloss and degree 3, root mean square. No light goes from
/// surface to surface.
///
/// `occlusion` is asked for pieces of some hundred thousand rays, which have to be answered in the order of the rays;
/// usually by a RayCaster for the mesh, and what else there is:
///
///     splatsFromMesh(mesh, options, [&](std::span<const Ray> rays) { return caster.castAny(rays); });
///
/// Empty: nothing is in the way of any light. Takes 25 microseconds a splat beside the rays, and 1 kB.
///
/// Errors: those of sampleSurface, "splats.from_mesh" (a value out of its range, or not finite, a color outside of
/// 0 to 1), "splats.occlusion" (not as many answers as rays); those of `occlusion`.
Expected<Splats> splatsFromMesh(const Mesh& mesh, const MeshSplatsOptions& options = {},
                                const OcclusionTest& occlusion = {});

}  // namespace glint
