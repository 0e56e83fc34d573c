// Any bytes give an error that names its place, or a scene whose instances can be cast at.

#include "fuzz.h"

#include <glint/format/mesh_scene.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<MeshScene> scene = parseMeshScene({reinterpret_cast<const char*>(data), size}, "fuzz.json");
    if (!scene) {
        fuzz::require(scene.error().id().starts_with("scene."));
        return 0;
    }
    fuzz::require(!scene->meshes.empty() && !scene->instances.empty());
    for (const MeshInstance& instance : scene->instances)
        fuzz::require(instance.mesh < scene->meshes.size() && isInvertible(instance.transform) && instance.mask < 256);
    return 0;
}
