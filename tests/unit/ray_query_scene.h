#pragma once

// Scenes for ray queries as each engine wants them, made at random.

#include "support/matchers.h"
#include "support/reference.h"

#include <glint/device/tracing.h>
#include <glint/geometry/primitives.h>
#include <glint/tracing/detail/instances.h>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <vector>

namespace glint::test {

/// Triangles or boxes.
struct Geometry {
    Mesh mesh;
    std::vector<float> boxes;
};

struct Bottom {
    std::vector<Geometry> geometries;
    bool opaque = true;
};

/// Two levels, for every engine.
struct Scene {
    std::vector<Bottom> bottoms;
    std::vector<Tracing::Instance> instances;
    std::vector<Matrix4x4f> transforms;
    std::vector<uint32_t> used;  ///< the bottom level of each instance
};

inline void put(std::vector<uint32_t>& words, const float* values, size_t count) {
    for (size_t i = 0; i < count; i++) words.push_back(std::bit_cast<uint32_t>(values[i]));
}

/// The scene as the plain library reads it; returns the address of its top level.
inline uint32_t encode(const Scene& scene, std::vector<uint32_t>& words) {
    std::vector<uint32_t> addresses;
    for (const Bottom& bottom : scene.bottoms) {
        const auto address = static_cast<uint32_t>(words.size());
        addresses.push_back(address);
        words.push_back(static_cast<uint32_t>(bottom.geometries.size()));
        words.resize(words.size() + 4 * bottom.geometries.size());
        for (size_t g = 0; g < bottom.geometries.size(); g++) {
            const Geometry& geometry = bottom.geometries[g];
            const auto first = static_cast<uint32_t>(words.size());
            for (const uint32_t index : geometry.mesh.indices) put(words, &geometry.mesh.positions[index].x, 3);
            put(words, geometry.boxes.data(), geometry.boxes.size());
            uint32_t* record = &words[address + 1 + 4 * g];
            record[0] = geometry.boxes.empty() ? 0 : 1;
            record[1] = first;
            record[2] = static_cast<uint32_t>(geometry.mesh.indices.size() / 3 + geometry.boxes.size() / 6);
            record[3] = bottom.opaque;
        }
    }
    const auto top = static_cast<uint32_t>(words.size());
    words.push_back(static_cast<uint32_t>(scene.instances.size()));
    for (size_t i = 0; i < scene.instances.size(); i++) {
        const Tracing::Instance& instance = scene.instances[i];
        const size_t first = words.size();
        put(words, instance.transform, 12);
        const Transform3x4 inverse(Matrix4x4f(glm::inverse(Matrix4x4d(scene.transforms[i]))));
        put(words, inverse.rows.data(), 12);
        words.push_back(instance.data | instance.mask << 24);
        words.push_back(instance.offset | instance.flags << 24);
        words.push_back(addresses[scene.used[i]]);
        words.resize(first + 32);
    }
    words.resize(words.size() + 32);
    return top;
}

/// The scene as the engine's traversal reads it; returns the first texel of its top level.
inline uint32_t encode(const Scene& scene, std::vector<detail::Texel>& texels) {
    std::vector<uint32_t> places;
    std::vector<BoundBox> bounds;
    const auto append = [&](const Expected<detail::Hierarchy>& hierarchy) {
        EXPECT_THAT(hierarchy, IsOk());
        const auto place = static_cast<uint32_t>(texels.size());
        texels.insert(texels.end(), hierarchy->texels.begin(), hierarchy->texels.end());
        return place;
    };
    for (const Bottom& bottom : scene.bottoms) {
        std::vector<detail::TriangleGeometry> triangles;
        std::vector<detail::BoxGeometry> boxes;
        for (const Geometry& geometry : bottom.geometries) {
            if (geometry.boxes.empty())
                triangles.push_back({.positions = reinterpret_cast<const std::byte*>(geometry.mesh.positions.data()),
                                     .vertices = static_cast<uint32_t>(geometry.mesh.positions.size()),
                                     .indices = reinterpret_cast<const std::byte*>(geometry.mesh.indices.data()),
                                     .index = detail::TriangleGeometry::Index::Uint32,
                                     .triangles = static_cast<uint32_t>(geometry.mesh.indices.size() / 3),
                                     .opaque = bottom.opaque});
            else
                boxes.push_back({.boxes = reinterpret_cast<const std::byte*>(geometry.boxes.data()),
                                 .count = static_cast<uint32_t>(geometry.boxes.size() / 6),
                                 .opaque = bottom.opaque});
        }
        const Expected<detail::Hierarchy> hierarchy =
            boxes.empty() ? detail::buildHierarchy(triangles, detail::BuildMode::Quality)
                          : detail::buildHierarchy(boxes, detail::BuildMode::Quality);
        places.push_back(append(hierarchy));
        bounds.push_back(detail::boundsOf(*hierarchy));
    }
    std::vector<detail::HierarchyInstance> instances;
    for (size_t i = 0; i < scene.instances.size(); i++)
        instances.push_back({.transform = Transform3x4(scene.transforms[i]),
                             .bounds = bounds[scene.used[i]],
                             .texel = places[scene.used[i]],
                             .custom_index = scene.instances[i].data,
                             .mask = scene.instances[i].mask,
                             .offset = scene.instances[i].offset,
                             .flags = scene.instances[i].flags});
    return append(detail::buildHierarchy(instances, detail::BuildMode::Quality));
}

inline void place(Scene& scene, uint32_t bottom, const Matrix4x4f& transform, uint32_t mask = 0xff,
                  uint32_t flags = 0) {
    Tracing::Instance instance;
    const Transform3x4 rows(transform);
    std::copy(rows.rows.begin(), rows.rows.end(), instance.transform);
    instance.data = static_cast<uint32_t>(0xabc000 + scene.instances.size());
    instance.offset = static_cast<uint32_t>(0x123400 + scene.instances.size());
    instance.mask = mask;
    instance.flags = flags;
    scene.instances.push_back(instance);
    scene.transforms.push_back(transform);
    scene.used.push_back(bottom);
}

inline Mesh soup(Random& random, uint32_t triangles) {
    Mesh mesh;
    for (uint32_t i = 0; i < triangles; i++) {
        const Vector3d centre(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
        for (uint32_t k = 0; k < 3; k++) {
            mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
            mesh.positions.push_back(Vector3f(centre + random.direction() * random.uniform(0.3, 1.2)));
        }
    }
    return mesh;
}

inline std::vector<float> randomBoxes(Random& random, uint32_t count) {
    std::vector<float> boxes;
    for (uint32_t i = 0; i < count; i++) {
        std::array<float, 6> box = {};
        for (size_t axis = 0; axis < 3; axis++) {
            box[axis] = static_cast<float>(random.uniform(-2, 1.5));
            box[axis + 3] = box[axis] + static_cast<float>(random.uniform(0.2, 0.8));
        }
        boxes.insert(boxes.end(), box.begin(), box.end());
    }
    return boxes;
}

/// Solid and transparent triangles in several geometries, instances that are turned, stretched, mirrored, masked
/// and flagged.
inline Scene triangles(uint32_t seed) {
    Random random(seed);
    Scene scene;
    scene.bottoms.push_back({{{soup(random, 20), {}}, {createSphere(1.0f, 1), {}}}, true});
    scene.bottoms.push_back({{{createTorus(1.2f, 0.4f, 8, 6), {}}, {soup(random, 15), {}}}, false});
    place(scene, 0, translate({0.5f, 0, 0}) * rotateX(33));
    place(scene, 1, translate({-1, 1, 0.4f}) * rotateY(70) * scale({0.5f, 1.4f, 0.8f}), 0x0f);
    place(scene, 0, translate({0, -1.2f, 1}) * scale({-1, 1, 1}) * rotateZ(20), 0xf0);
    place(scene, 1, rotateX(111) * scale({0.6f, 0.6f, 0.6f}), 0xff, Tracing::InstanceOpaque);
    place(scene, 0, translate({1, 1, -1}), 0x3c, Tracing::InstanceTransparent);
    place(scene, 1, translate({-1.5f, -0.5f, 0}), 0xff, Tracing::InstanceFlipFacing);
    place(scene, 0, translate({0, 2, 0}) * rotateY(10), 0xff, Tracing::InstanceCullDisable);
    return scene;
}

}  // namespace glint::test
