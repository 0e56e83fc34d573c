#pragma once

#include <glint/format/mesh.h>

#include <filesystem>
#include <string_view>

namespace glint::detail {

/// The endings, with the dot, of files that readThroughAssimp() reads.
inline constexpr std::string_view assimp_extensions[] = {".3ds", ".ac",  ".ase", ".blend", ".dae",
                                                         ".fbx", ".lwo", ".off", ".smd",   ".stl"};

/// Reads a mesh as it stands at rest, all nodes of the file together, through assimp's shared library, which is opened
/// the first time. See Mesh::load.
Expected<Mesh> readThroughAssimp(const std::filesystem::path& path, uint64_t limit);

}  // namespace glint::detail
