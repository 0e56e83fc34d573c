#pragma once

// From where levels of detail are looked at.

#include "support/reference.h"

#include <glint/format/mesh.h>
#include <glint/math/camera.h>

namespace glint::test {

/// Kinds of views: from near and from afar; from within the ball around a mesh, any way; along its surface, from close
/// by; with angles of 120 to 170 degrees.
enum class ViewKind : uint8_t { Near, Far, Inside, Grazing, Wide };
inline constexpr ViewKind view_kinds[] = {ViewKind::Near, ViewKind::Far, ViewKind::Inside, ViewKind::Grazing,
                                          ViewKind::Wide};
const char* nameOf(ViewKind kind);

/// A camera and an instance: every second one turned, mirrored and stretched by 1 : 1.5 : 0.3.
struct LevelView {
    CameraParameters camera;
    Transform3x4 instance;
};

/// A view of a mesh, at random.
LevelView levelView(Random& random, ViewKind kind, const Mesh& mesh, float aspect);

}  // namespace glint::test
