#pragma once

#include <glint/base/expected.h>
#include <glint/math/camera.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// A camera that took, or shall take, a picture.
struct PictureCamera {
    Camera camera;
    uint32_t width = 0;  ///< pixels
    uint32_t height = 0;
    std::string name;  ///< of the picture
};

/// Reads the cameras.json that the program of "3D Gaussian Splatting" (see Splats) writes beside its scenes: a list of
/// objects with `position` (x, y, z of the eye), `rotation` (three rows of three: the columns are the camera's axes x
/// right, y down, z forward in the space of the scene), `fx` and `fy` (focal lengths in pixels), `width`, `height` and,
/// where it has one, `img_name`. All other keys are passed over. The principal point is the centre of the picture.
///
/// Directions are within 3e-7 of the file's, tangents of the field of view within 1e-6 of theirs, relatively. `name`
/// names the file in errors, which have the camera's place in the list: "cameras.json" (no JSON, no list, a key that
/// stands twice, values nested more than 8 deep), "cameras.key" (one is missing, or has a value of another type),
/// "cameras.value" (a number that is not finite or out of range: sizes of 1 to 65,536, fields of view of 0.01 to 179
/// degrees), "cameras.rotation" (rows that make no rotation, within 1e-3).
Expected<std::vector<PictureCamera>> parseCameras(std::string_view text, const std::string& name);

/// The same of a file of at most 64 MiB. Errors: those and those of readFile.
Expected<std::vector<PictureCamera>> loadCameras(const std::filesystem::path& path);

}  // namespace glint
