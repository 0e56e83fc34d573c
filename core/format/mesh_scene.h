#pragma once

#include <glint/base/expected.h>
#include <glint/format/mesh.h>
#include <glint/math/math.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// One of several meshes, in a place.
struct MeshInstance {
    static constexpr uint32_t by_place = UINT32_MAX;

    uint32_t mesh = 0;          ///< which of the meshes
    Transform3x4 transform;     ///< mesh to world: finite, and no plane or line is made of the mesh
    uint32_t mask = 0xff;       ///< 8 bits: only rays whose mask shares one of them see it
    uint32_t index = by_place;  ///< what hits call it; by_place: its number among the instances
    bool operator==(const MeshInstance&) const = default;
};

/// True if the transform is finite and can be inverted: if its three axes span a volume that float32 entries can tell
/// from none, and float32 can hold the inverse.
bool isInvertible(const Transform3x4& transform);

/// Meshes of files and where their instances stand, as `glint cast` reads them from a JSON text.
///
///     {
///         "meshes": {"bunny": "models/bunny.obj", "floor": "floor.ply"},
///         "instances": [
///             {"mesh": "floor"},
///             {"mesh": "bunny", "translate": [0, 0, 1], "rotate": [0, 0, 1, 90], "scale": 2, "index": 7},
///             {"mesh": "bunny", "transform": [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, -1, 0]], "mask": 2}
///         ]
///     }
///
/// Files are relative to the scene's folder. A place is a `transform`, three rows of four numbers, or any of
/// `translate` (x, y, z), `rotate` (an axis of any length through the origin, and degrees, counter-clockwise seen from
/// its tip) and `scale` (one number, or three): p' = translate + rotate(scale * p). `mask` is 0 to 255, `index` at
/// most 4294967294.
struct MeshScene {
    static constexpr uint64_t max_bytes = 1ull << 28;  ///< of the text
    static constexpr size_t max_meshes = 1u << 16;
    static constexpr size_t max_instances = 1u << 20;

    /// A mesh of the scene.
    struct File {
        std::string name;
        std::filesystem::path path;  ///< as opened
        bool operator==(const File&) const = default;
    };
    std::vector<File> meshes;             ///< in the order of their names
    std::vector<MeshInstance> instances;  ///< in the order of the text

    /// Reads the text of a file; the meshes are not opened. Errors: those of readFile and parseMeshScene.
    static Expected<MeshScene> load(const std::filesystem::path& path);

    /// Reads the meshes. Errors: those of Mesh::load; `limit` is that of all together.
    Expected<std::vector<Mesh>> loadMeshes(uint64_t limit = Mesh::default_limit) const;

    bool operator==(const MeshScene&) const = default;
};

/// The same from a text; `path` is that of the scene's file. Errors name it and the place, such as
/// `instances[3].transform`: "scene.json" (no JSON, nested too deep, or a key twice), "scene.missing" (a required key
/// is absent), "scene.key" (a key that means nothing, or that excludes another one), "scene.type" (a value of another
/// JSON type), "scene.count" (not as many elements as there have to be, or may be), "scene.value" (a number that is out
/// of range), "scene.mesh" (an instance of a mesh that is not listed).
Expected<MeshScene> parseMeshScene(std::string_view text, const std::filesystem::path& path);

}  // namespace glint
