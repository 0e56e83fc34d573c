#pragma once

// The evaluation of a Scene in float64, with a bound of what float32 may differ from it by.

#include <glint/format/scene.h>

#include <glm/mat3x3.hpp>

#include <vector>

namespace glint::test {

/// A value, and how far off the float32 evaluation may be: a running error bound, in units of the value.
template <class T>
struct Bounded {
    T value = T(0.0);
    T bound = T(0.0);
};

struct ReferencePose {
    std::vector<Bounded<Matrix4x4d>> world;
    std::vector<std::vector<Bounded<double>>> weights;
};

/// Scene::pose(animation, time); `animation` may be scene_none, for rest.
ReferencePose referencePose(const Scene& scene, uint32_t animation, float time);

struct ReferenceMesh {
    std::vector<Bounded<Vector3d>> positions;
    std::vector<Bounded<Vector3d>> normals;  ///< empty unless every primitive has them
};

/// How many roundings a transformed normal takes besides those of its matrix: each product of a cofactor and a
/// component of the normal, and each component at the end. The host works in float64 and rounds once.
struct NormalRounding {
    double products = 0.0;
    double unit = 1.0;
};

/// The vertices of Scene::mesh(pose), in its order.
ReferenceMesh referenceMesh(const Scene& scene, const ReferencePose& pose, const NormalRounding& rounding = {});

/// A chain of six nodes beside a node with a skinned mesh whose joints are three of them, and one with a plain mesh:
/// morphed, animated by all interpolations, quaternions of any length and sign.
Scene randomScene(uint64_t seed);

}  // namespace glint::test
