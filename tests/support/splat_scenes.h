#pragma once

// Scenes of Gaussian splats that renderers are tried on. All but the one read from a file are made by formula, and are
// the same everywhere.

#include <glint/base/expected.h>
#include <glint/format/splats.h>
#include <glint/math/camera.h>

#include <filesystem>
#include <string>
#include <vector>

namespace glint::test {

struct SplatScene {
    std::string name;
    Splats splats;
    Camera camera;
    uint32_t width = 0, height = 0;
};

/// A splat without harmonics beyond the color, which is the one seen (0 and more).
void addSplat(Splats& splats, const Vector3f& position, const Vector3f& scales, const Vector4f& rotation, float opacity,
              const Vector3f& color);

/// The file of splats that $GLINT_SPLATS names, of a real scene; empty if there is none.
std::filesystem::path splatsPath();

/// At the beginning of a test: skips it where no scene is named.
#define GLINT_NEED_SPLATS() \
    if (::glint::test::splatsPath().empty()) GTEST_SKIP() << "needs a scene of splats: GLINT_SPLATS=FILE.ply"

/// A camera that looks at the middle of a scene from `from` away, in units of the distance from which all of it is seen
/// for certain.
Camera cameraAround(const Splats& splats, const Vector3f& from, const Vector3f& up, float fov, uint32_t width,
                    uint32_t height);

/// The scene of splatsPath(), as figures name it. Errors: those of Splats::load.
Expected<SplatScene> realSplatScene(uint32_t width, uint32_t height);

/// The surface of a torus: flat discs that overlap, opaque in their middle, with harmonics of a degree that change as
/// the light on something glossy does.
SplatScene surfaceScene(uint32_t count, uint32_t degree, uint32_t width, uint32_t height);

/// Needles, 2 * `sigma` pixels long and 0.2 wide, through the middle of the picture at `count` angles.
SplatScene needleScene(uint32_t count, float sigma, uint32_t width, uint32_t height);

/// Splats all over the picture and a little beyond, whatever its size and field of view.
SplatScene spreadScene(const std::string& name, uint32_t count, float fov, uint32_t width, uint32_t height);

/// `count` small splats of random colors within 16 x 16 pixels that are one tile, and a few around.
SplatScene crowdScene(uint32_t count, float opacity);

/// What is hard in some way; colors are at most 1. Names: needles, crowd, inside, near, opacity, equal_depths, faint,
/// flat, huge, beside, wide, narrow.
std::vector<SplatScene> hardSplatScenes();

}  // namespace glint::test
