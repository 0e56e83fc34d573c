// Any bytes give an error or a scene that is valid and can be posed and flattened.

#include <glint/base/log.h>
#include <glint/format/gltf.h>

#include <algorithm>
#include <cstdlib>

using namespace glint;

namespace {

constexpr uint64_t limit = 1 << 20;

/// Ends the program, so that libFuzzer keeps the input.
void require(bool condition) {
    if (!condition) std::abort();
}

void flatten(const Scene& scene, const ScenePose& pose) {
    const Expected<Mesh> mesh = scene.mesh(pose, limit);
    require(mesh ? static_cast<bool>(mesh->validate()) : mesh.error().id().starts_with("mesh."));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    [[maybe_unused]] static const bool is_silent = [] {
        setLogCallback([](LogLevel, std::string_view, std::string_view) {});
        return true;
    }();
    GltfOptions options;
    options.limit = limit;
    options.read = [](const std::string& name, uint64_t most) -> Expected<std::vector<std::byte>> {
        return std::vector<std::byte>(std::min<uint64_t>(most, 64), static_cast<std::byte>(name.size()));
    };
    const Expected<Scene> scene = parseGltf(std::as_bytes(std::span(data, size)), options);
    if (!scene) {
        require(scene.error().id().starts_with("gltf.") || scene.error().id().starts_with("image."));
        return 0;
    }
    require(static_cast<bool>(scene->validate()));
    flatten(*scene, scene->pose());
    for (uint32_t i = 0; i < std::min<size_t>(scene->animations.size(), 3); i++)
        for (const float part : {0.0f, 0.3f, 1.0f})
            flatten(*scene, scene->pose(i, part * scene->animations[i].duration()));
    return 0;
}
