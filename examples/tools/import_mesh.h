#pragma once

#include <glint/format/mesh.h>

#include <filesystem>
#include <string_view>

namespace tool {

/// The endings, with the dot, of files that importMesh() reads.
inline constexpr std::string_view import_extensions[] = {".3ds", ".ac",  ".ase", ".blend", ".dae",
                                                         ".fbx", ".lwo", ".off", ".smd",   ".stl"};

/// Reads a mesh as it stands at rest through assimp, if its library is installed: all nodes of the file together,
/// polygons split into triangles, equal vertices joined, a part for each of the file's meshes. Other files are
/// Mesh::load's.
///
/// assimp runs in a child process, which may end as it likes: in four seconds and one for each 100 kB of the file, or
/// in 1 GiB and twice the limit. The child is a copy of this process (fork), which is why the SDK does not do this: a
/// program with several threads could not. To be called before the process has a second one. SIGCHLD is set to its
/// default. Errors: those of Mesh::load; "tool.library" (assimp is not installed, or of another version),
/// "tool.import" (it cannot read the file), "tool.threads" (the process has several).
glint::Expected<glint::Mesh> importMesh(const std::filesystem::path& path, uint64_t limit = glint::Mesh::default_limit);

}  // namespace tool
