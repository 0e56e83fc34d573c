#include "support/instance_compare.h"

#include <glint/base/file.h>
#include <glint/format/npy.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace glint::test {

Expected<InstancePicture> InstancePicture::load(const std::filesystem::path& path) {
    const Expected<std::vector<std::byte>> bytes = readFile(path);
    if (!bytes) return unexpected(bytes.error());
    const Expected<NpyArray> array = decodeNpy(*bytes);
    if (!array) return unexpected(array.error());
    const std::span<const uint32_t> values = array->values<uint32_t>();
    const std::vector<uint64_t>& shape = array->header.shape;
    if (shape.size() != 2 || values.empty())
        return unexpected(Error(ErrorCode::InvalidArgument, "test.shape", describe(array->header) + " is no picture"));
    InstancePicture picture;
    picture.height = static_cast<uint32_t>(shape[0]);
    picture.width = static_cast<uint32_t>(shape[1]);
    picture.instances.assign(values.begin(), values.end());
    return picture;
}

bool InstancePicture::isNearEdge(uint32_t x, uint32_t y) const {
    const uint32_t here = at(x, y);
    for (uint32_t j = y - (y > 0); j <= std::min(y + 1, height - 1); j++)
        for (uint32_t i = x - (x > 0); i <= std::min(x + 1, width - 1); i++)
            if (at(i, j) != here) return true;
    return false;
}

InstanceDifferences compareInstances(const InstancePicture& a, const InstancePicture& b) {
    InstanceDifferences result;
    result.pixels = a.instances.size();
    for (uint32_t y = 0; y < a.height; y++)
        for (uint32_t x = 0; x < a.width; x++) {
            const int edges = int(a.isNearEdge(x, y)) + int(b.isNearEdge(x, y));
            result.edge_pixels += edges > 0;
            if (a.at(x, y) == b.at(x, y)) continue;
            (edges == 2 ? result.near_both : edges == 1 ? result.near_one : result.elsewhere)++;
            (edges == 2 ? result.near_both_pixels : result.other_pixels).emplace_back(x, y);
        }
    return result;
}

uint32_t InstanceJudge::at(const Vector2d& place) const {
    const Vector3d direction = Vector3d(Vector4d(camera_.ray_corner)) +
                               Vector3d(Vector4d(camera_.ray_x)) * (place.x / width_) +
                               Vector3d(Vector4d(camera_.ray_y)) * (place.y / height_);
    return reference_.closestHit(Vector3d(Vector4d(camera_.position)), glm::normalize(direction), 1000.0).instance;
}

bool InstanceJudge::isSeen(uint32_t instance, const Vector2u& pixel, double distance) const {
    const Vector2d center = Vector2d(pixel) + 0.5;
    const int steps = static_cast<int>(std::floor(distance * 8.0));
    // From the middle outwards: mostly what is asked for is near.
    for (int ring = 0; ring <= steps; ring++)
        for (int j = -ring; j <= ring; j++)
            for (int i = -ring; i <= ring; i += std::abs(j) == ring ? 1 : 2 * ring)
                if (at(center + Vector2d(i, j) / 8.0) == instance) return true;
    return false;
}

}  // namespace glint::test
