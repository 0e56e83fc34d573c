// Any bytes as cameras.json: an error, or cameras whose numbers are all finite.

#include "fuzz.h"

#include <glint/format/cameras.h>

#include <cmath>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto cameras = parseCameras({reinterpret_cast<const char*>(data), size}, "fuzz.json");
    if (!cameras) {
        fuzz::require(cameras.error().id().starts_with("cameras."));
        return 0;
    }
    for (const PictureCamera& each : *cameras) {
        fuzz::require(each.width >= 1 && each.height >= 1);
        const CameraParameters parameters = each.camera.parameters();
        for (int column = 0; column < 4; column++)
            for (int row = 0; row < 4; row++)
                fuzz::require(std::isfinite(parameters.view[column][row]) &&
                              std::isfinite(parameters.inverse_view[column][row]) &&
                              std::isfinite(parameters.projection[column][row]));
    }
    return 0;
}
