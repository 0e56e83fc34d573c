#include <glint/geometry/mesh_splats.h>

#include <glint/base/format_error.h>
#include <glint/geometry/surface_samples.h>
#include <glint/math/harmonics.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint {

namespace {

constexpr float radius_over_spacing = 0.75f;
constexpr float thickness_over_radius = 0.1f;
constexpr float opacity = 0.98f;
/// Directions are fitted down to this cosine, with the color at the horizon: discs at an outline are seen from behind a
/// little.
constexpr float least_cosine = -0.3f;
/// What other directions count, with the color that does not depend on the view: splats are seen from there through
/// gaps and where a surface ends, and a fit that did not know of them would be anything there.
constexpr double unseen_weight = 0.01;
/// Discs follow the normals as far as this angle from their triangle, as coarse meshes would be covered with scales.
constexpr float largest_tilt = radians(25.0f);
constexpr float shininess = 16.0f;  // exponent of the lobe: narrower ones are beyond degree 3
constexpr size_t piece = 4096;      // splats whose rays are cast at once

/// A turn that brings +Z to the normal: the shortest from +Z or -Z, whichever is nearer.
glm::quat frameOf(const Vector3f& normal) {
    if (normal.z >= 0.0f) return glm::normalize(glm::quat(1.0f + normal.z, -normal.y, normal.x, 0.0f));
    return glm::normalize(glm::quat(1.0f - normal.z, normal.y, -normal.x, 0.0f)) * glm::quat(0.0f, 1.0f, 0.0f, 0.0f);
}

/// A point of the unit disc for one of the unit square, area for area.
Vector2f discPoint(const Vector2f& u) {
    const float angle = 2.0f * pi * u.y, radius = std::sqrt(u.x);
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// The i-th of `count` points that fill the unit square evenly (Fibonacci's lattice), shifted by `shift`.
Vector2f latticePoint(uint32_t i, uint32_t count, const Vector2f& shift) {
    const float x = (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    const auto y = static_cast<float>(std::fmod(i * 0.61803398874989485, 1.0));
    return {glm::fract(x + shift.x), glm::fract(y + shift.y)};
}

/// A light as it is shown, less the half that harmonics begin at.
Vector3f display(const Vector3f& light) {
    Vector3f color;
    for (int k = 0; k < 3; k++) color[k] = std::pow(std::clamp(light[k], 0.0f, 1.0f), 1.0f / 2.2f) - 0.5f;
    return color;
}

/// The normal of a disc: the sample's, or what is on the way to it from that of its triangle.
Vector3f discNormal(const Mesh& mesh, const SurfaceSample& sample) {
    const uint32_t* corners = &mesh.indices[size_t{sample.triangle} * 3];
    Vector3f face = surfacePoint(mesh.positions[corners[0]], mesh.positions[corners[1]], mesh.positions[corners[2]],
                                 sample.barycentrics, {}, {})
                        .normal;
    if (glm::dot(face, sample.normal) < 0.0f) face = -face;
    const float cosine = glm::dot(face, sample.normal);
    const Vector3f aside = sample.normal - cosine * face;
    if (cosine >= std::cos(largest_tilt) || face == Vector3f(0.0f) || !(glm::length(aside) > 1e-6f))
        return sample.normal;
    return std::cos(largest_tilt) * face + std::sin(largest_tilt) * glm::normalize(aside);
}

/// Lights splats: a light, a surface, and the directions from which colors are wanted.
class Baker {
public:
    Baker(const MeshSplatsOptions& options, const OcclusionTest& occlusion)
        : options_(options),
          occlusion_(occlusion),
          up_(glm::normalize(options.light.up)),
          lamp_(glm::normalize(options.light.direction)),
          lamp_frame_(frameOf(lamp_)) {
        const SphereRule rule = sphereRule(8);
        std::vector<Vector3d> from_eye;
        std::vector<double> weights;
        for (size_t i = 0; i < rule.directions.size(); i++) {
            const bool is_seen = rule.directions[i].z >= double{least_cosine};
            to_eye_.emplace_back(rule.directions[i]);
            from_eye.push_back(-rule.directions[i]);
            weights.push_back(rule.weights[i] * (is_seen ? 1.0 : unseen_weight));
        }
        fit_ = HarmonicsFit(options.degree, from_eye, weights);
        const SphereRule all = sphereRule(4);
        for (const Vector3d& direction : all.directions) turned_.emplace_back(direction);
        turn_ = HarmonicsFit(options.degree, all.directions, all.weights);
    }

    /// Fills the harmonics of the splats on these samples.
    Status bake(const Mesh& mesh, std::span<const SurfaceSample> samples, std::span<Vector3f> harmonics) {
        std::vector<uint8_t> hidden;
        if (Status status = castRays(mesh, samples, hidden); !status) return status;
        for (size_t i = 0; i < samples.size(); i++) {
            const Vector3f color = options_.color ? options_.color(samples[i].position) : Vector3f(0.6f);
            if (!(color.x >= 0 && color.y >= 0 && color.z >= 0 && color.x <= 1 && color.y <= 1 && color.z <= 1))
                return makeError(ErrorCode::OutOfRange, "splats.from_mesh",
                                 "splats of a mesh: the color ({}, {}, {}) at ({}, {}, {}) is not within 0 and 1",
                                 color.x, color.y, color.z, samples[i].position.x, samples[i].position.y,
                                 samples[i].position.z);
            const Arrived arrived = gather(samples[i], std::span(hidden).subspan(i * rays(), rays()));
            shade(samples[i].normal, color, arrived, harmonics.subspan(i * fit_.coefficientCount()));
        }
        return {};
    }

private:
    /// The light that arrives at a splat.
    struct Arrived {
        float lamp = 0.0f;                  ///< share of the lamp that is seen
        float sky_share = 0.0f;             ///< share of the sky and the ground that is seen
        Vector3f diffuse = Vector3f(0.0f);  ///< mean of sky and ground over what is seen, by Lambert's law
    };

    uint32_t rays() const { return options_.lamp_rays + options_.sky_rays; }

    Vector3f lampDirection(uint32_t ray, const Vector2f& shift) const {
        const Vector2f at =
            discPoint(latticePoint(ray, options_.lamp_rays, shift)) * std::tan(radians(options_.light.radius));
        return lamp_frame_ * Vector3f(at.x, at.y, 1.0f);
    }

    /// Of all directions above the surface those by Lambert's law.
    Vector3f skyDirection(uint32_t ray, const Vector2f& shift, const glm::quat& frame) const {
        const Vector2f at = discPoint(latticePoint(ray, options_.sky_rays, shift));
        return frame * Vector3f(at.x, at.y, std::sqrt(std::max(0.0f, 1.0f - at.x * at.x - at.y * at.y)));
    }

    /// Each splat has a pattern of its own: what a few rays miss is noise then, which its neighbours even out.
    static Vector2f shiftOf(const SurfaceSample& sample) {
        return {glm::fract(sample.barycentrics.x * 431.7f + sample.barycentrics.y * 97.3f),
                glm::fract(sample.barycentrics.x * 173.1f + sample.barycentrics.y * 611.9f)};
    }

    Vector3f skyColor(const Vector3f& direction) const {
        return glm::mix(options_.light.ground, options_.light.sky, 0.5f + 0.5f * glm::dot(direction, up_));
    }

    /// The rays of each sample: to the lamp, then to the sky. hidden: 1 where something is in the way, or where the
    /// direction is below the surface.
    Status castRays(const Mesh& mesh, std::span<const SurfaceSample> samples, std::vector<uint8_t>& hidden) {
        std::vector<Ray> cast(samples.size() * rays());
        std::vector<uint8_t> below(cast.size());
        for (size_t i = 0; i < samples.size(); i++) {
            const SurfaceSample& sample = samples[i];
            const uint32_t* corners = &mesh.indices[size_t{sample.triangle} * 3];
            SurfacePoint point = surfacePoint(mesh.positions[corners[0]], mesh.positions[corners[1]],
                                              mesh.positions[corners[2]], sample.barycentrics, {}, {});
            // The side that the normals say.
            const Vector3f side = glm::dot(point.normal, sample.normal) < 0.0f ? -point.normal : point.normal;
            const glm::quat frame = frameOf(sample.normal);
            const Vector2f shift = shiftOf(sample);
            for (uint32_t k = 0; k < rays(); k++) {
                const bool is_lamp = k < options_.lamp_rays;
                const Vector3f direction =
                    is_lamp ? lampDirection(k, shift) : skyDirection(k - options_.lamp_rays, shift, frame);
                const size_t at = i * rays() + k;
                below[at] = glm::dot(direction, is_lamp ? sample.normal : side) <= 0.0f;
                // A ray without a direction meets nothing, at no cost.
                if (!below[at]) cast[at] = {spawnPoint(point, side), 0.0f, direction};
            }
        }
        if (!occlusion_) {
            hidden = std::move(below);
            return {};
        }
        Expected<std::vector<uint8_t>> answers = occlusion_(cast);
        if (!answers) return answers.error();
        if (answers->size() != cast.size())
            return makeError(ErrorCode::InvalidArgument, "splats.occlusion", "splats of a mesh: {} answers for {} rays",
                             answers->size(), cast.size());
        hidden = std::move(*answers);
        for (size_t i = 0; i < hidden.size(); i++) hidden[i] |= below[i];
        return {};
    }

    Arrived gather(const SurfaceSample& sample, std::span<const uint8_t> hidden) const {
        Arrived arrived;
        for (uint32_t k = 0; k < options_.lamp_rays; k++) arrived.lamp += hidden[k] ? 0.0f : 1.0f;
        arrived.lamp /= static_cast<float>(options_.lamp_rays);
        const glm::quat frame = frameOf(sample.normal);
        const Vector2f shift = shiftOf(sample);
        for (uint32_t k = 0; k < options_.sky_rays; k++) {
            if (hidden[options_.lamp_rays + k]) continue;
            arrived.sky_share += 1.0f;
            arrived.diffuse += skyColor(skyDirection(k, shift, frame));
        }
        arrived.sky_share /= static_cast<float>(options_.sky_rays);
        arrived.diffuse /= static_cast<float>(options_.sky_rays);
        return arrived;
    }

    void shade(const Vector3f& normal, const Vector3f& color, const Arrived& arrived, std::span<Vector3f> harmonics) {
        const glm::quat frame = frameOf(normal);
        const Vector3f lamp = glm::conjugate(frame) * lamp_;
        const Vector3f up = glm::conjugate(frame) * up_;
        const Vector3f lamp_light = options_.light.lamp * (std::max(lamp.z, 0.0f) * arrived.lamp);
        const Vector3f diffuse = (1.0f - options_.gloss) * color * (lamp_light + arrived.diffuse);
        const auto schlick = [this](float cosine) {
            const float x = 1.0f - std::clamp(cosine, 0.0f, 1.0f);
            return options_.gloss + (1.0f - options_.gloss) * (x * x * x * x * x);
        };
        values_.resize(to_eye_.size());
        for (size_t i = 0; i < to_eye_.size(); i++) {
            Vector3f eye = to_eye_[i];
            if (eye.z < least_cosine) {
                values_[i] = display(diffuse);
                continue;
            }
            if (eye.z < 0.0f) eye = glm::normalize(Vector3f(eye.x, eye.y, 1e-3f));
            const Vector3f half = glm::normalize(eye + lamp);
            // Normalised so that a white lobe sends on as much as arrives, whatever its exponent.
            const float lobe =
                schlick(glm::dot(half, eye)) * (shininess + 8.0f) / 8.0f * std::pow(std::max(half.z, 0.0f), shininess);
            const float height = glm::dot(Vector3f(-eye.x, -eye.y, eye.z), up);
            const Vector3f mirrored = glm::mix(options_.light.ground, options_.light.sky, 0.5f + 0.5f * height);
            const Vector3f light = diffuse + lobe * lamp_light + schlick(eye.z) * arrived.sky_share * mirrored;
            values_[i] = display(light);
        }
        std::array<Vector3f, max_harmonics> local;
        fit_.fit(values_, local);
        // The same sum as a function of directions in the mesh's space.
        turned_values_.assign(turned_.size(), Vector3f(0.0f));
        for (size_t i = 0; i < turned_.size(); i++) {
            const auto y = evaluateHarmonics(glm::conjugate(frame) * turned_[i]);
            for (uint32_t k = 0; k < fit_.coefficientCount(); k++) turned_values_[i] += y[k] * local[k];
        }
        turn_.fit(turned_values_, harmonics);
    }

    const MeshSplatsOptions& options_;
    const OcclusionTest& occlusion_;
    Vector3f up_;
    Vector3f lamp_;
    glm::quat lamp_frame_;
    std::vector<Vector3f> to_eye_;  ///< directions, the normal being +Z
    HarmonicsFit fit_ = HarmonicsFit(0, {}, {});
    std::vector<Vector3f> turned_;
    HarmonicsFit turn_ = HarmonicsFit(0, {}, {});
    std::vector<Vector3f> values_;
    std::vector<Vector3f> turned_values_;
};

Status checkOptions(const MeshSplatsOptions& options) {
    const auto fail = [](const char* what, auto value, const char* range) {
        return makeError(ErrorCode::OutOfRange, "splats.from_mesh", "splats of a mesh: {} {}; {}", what, value, range);
    };
    const SplatLight& light = options.light;
    if (options.degree > Splats::max_degree) return fail("degree", options.degree, "0 to 3 are known");
    if (!(options.gloss >= 0.0f && options.gloss <= 1.0f))
        return fail("gloss", options.gloss, "it lies within 0 and 1");
    if (!(light.radius >= 0.0f && light.radius <= 45.0f))
        return fail("radius of the lamp", light.radius, "it lies within 0 and 45 degrees");
    if (options.lamp_rays < 1 || options.lamp_rays > 64)
        return fail("number of rays to the lamp", options.lamp_rays, "1 to 64 can be cast");
    if (options.sky_rays < 1 || options.sky_rays > 1024)
        return fail("number of rays to the sky", options.sky_rays, "1 to 1024 can be cast");
    const auto checkVector = [](const char* what, const Vector3f& v, bool is_valid) -> Status {
        if (is_valid) return {};
        return makeError(ErrorCode::OutOfRange, "splats.from_mesh", "splats of a mesh: the light's {} is ({}, {}, {})",
                         what, v.x, v.y, v.z);
    };
    for (const auto& [what, v] : {std::pair("up", light.up), std::pair("direction", light.direction)}) {
        const float length = glm::length(v);
        if (Status status = checkVector(what, v, length > 1e-18f && std::isfinite(length)); !status) return status;
    }
    for (const auto& [what, v] :
         {std::pair("lamp", light.lamp), std::pair("sky", light.sky), std::pair("ground", light.ground)})
        if (Status status = checkVector(what, v, isFinite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0); !status)
            return status;
    return {};
}

}  // namespace

Expected<Splats> splatsFromMesh(const Mesh& mesh, const MeshSplatsOptions& options, const OcclusionTest& occlusion) {
    if (Status status = checkOptions(options); !status) return unexpected(status.error());
    const Expected<std::vector<SurfaceSample>> samples = sampleSurface(mesh, options.count);
    if (!samples) return unexpected(samples.error());

    Splats splats;
    splats.degree = options.degree;
    const size_t count = samples->size();
    splats.opacities.assign(count, opacity);
    splats.harmonics.resize(count * splats.coefficientCount());
    for (const SurfaceSample& sample : *samples) {
        const glm::quat frame = frameOf(discNormal(mesh, sample));
        const float radius = radius_over_spacing * sample.spacing;
        splats.positions.push_back(sample.position);
        splats.scales.emplace_back(radius, radius, thickness_over_radius * radius);
        splats.rotations.emplace_back(frame.x, frame.y, frame.z, frame.w);
    }
    Baker baker(options, occlusion);
    for (size_t first = 0; first < count; first += piece) {
        const size_t size = std::min(piece, count - first);
        const std::span harmonics = std::span(splats.harmonics).subspan(first * splats.coefficientCount());
        if (Status status = baker.bake(mesh, std::span(*samples).subspan(first, size), harmonics); !status)
            return unexpected(status.error());
    }
    return splats;
}

}  // namespace glint
