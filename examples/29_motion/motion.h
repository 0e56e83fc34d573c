#pragma once

// How the three bodies of 29_motion move, in the world of the course's stage.

#include "common/course.h"

#include <glint/format/scene.h>

#include <array>
#include <cmath>

/// Two moments, and what is between them. 0 is the first, 1 the second.
struct Motion {
    enum Body : uint32_t { MatrixKeys, TransformKeys, Morph, body_count };

    Motion(const CourseStage& stage, double begin, double end)
        : rest_(stage.transform(CourseStage::object_mesh).matrix()),
          keys_{poseAt(begin), poseAt(end)},
          weights_{weightAt(begin), weightAt(end)} {}

    /// Where the mesh stands at a moment. Matrix keys are interpolated element by element: right for what does not
    /// turn, while what turns by an angle a shrinks to cos(a / 2) in between. Keys of scale, rotation (a quaternion,
    /// whose length does not count) and translation are interpolated one by one, and what turns keeps its size.
    glint::Transform3x4 transform(Body body, float moment) const {
        using namespace glint;
        Matrix4x4f pose = scale(Vector3f(size));
        if (body == MatrixKeys) {
            const Matrix4x4f first = keys_[0].matrix(), second = keys_[1].matrix();
            for (int i = 0; i < 4; i++) pose[i] = glm::mix(first[i], second[i], moment);
        } else if (body == TransformKeys) {
            SceneTransform key;
            key.translation = glm::mix(keys_[0].translation, keys_[1].translation, moment);
            key.rotation = glm::mix(keys_[0].rotation, keys_[1].rotation, moment);
            key.scale = glm::mix(keys_[0].scale, keys_[1].scale, moment);
            pose = key.matrix();
        }
        return Transform3x4(placeOf(body) * pose * rest_);
    }

    /// How much of the target there is in the third body's corners.
    float weight(float moment) const { return weights_[0] + (weights_[1] - weights_[0]) * moment; }

    /// What the mesh becomes at weight 1: twisted about its Y axis by half a turn from bottom to top.
    static glint::Mesh target(glint::Mesh mesh) {
        using namespace glint;
        const BoundBox box = mesh.bounds();
        const float height = std::max(box.size().y, 1e-30f);
        for (Vector3f& position : mesh.positions) {
            const Vector3f from = position - box.center();
            position = box.center() + transformPoint(rotateY(180.0f * from.y / height), from);
        }
        mesh.createNormals();
        return mesh;
    }

private:
    static constexpr float size = 0.6f;  // of a body over that of the mesh

    static glint::Matrix4x4f placeOf(Body body) {
        return glint::translate({0.0f, (static_cast<float>(body) - 1.0f) * 2.5f, 0.1f});
    }
    static glint::SceneTransform poseAt(double time) {
        const double half = 0.5 * 3.5 * (time + 0.4);  // of its angle about Z, 3.5 radians a second
        glint::SceneTransform pose;
        pose.translation = {0.0f, 0.0f, 0.5f + 0.5f * static_cast<float>(std::sin(2.5 * time - 0.6))};
        pose.rotation = {0.0f, 0.0f, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))};
        pose.scale = glint::Vector3f(size);
        return pose;
    }
    static float weightAt(double time) { return 0.5f + 0.5f * static_cast<float>(std::sin(3.0 * time - 1.2)); }

    glint::Matrix4x4f rest_;
    std::array<glint::SceneTransform, 2> keys_;
    std::array<float, 2> weights_;
};
