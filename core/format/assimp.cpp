// Formats that have no smaller library. assimp is opened when the first such file is read: linking it would make every
// program load 10 MB of library and its dependencies. Its C interface lets no exception out.

#include <glint/format/detail/assimp.h>

#include <glint/base/format_error.h>

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <dlfcn.h>

#include <cmath>
#include <memory>
#include <mutex>

namespace glint::detail {

namespace {

/// The functions of the library that are used.
struct Library {
    decltype(&aiImportFileExWithProperties) import = nullptr;
    decltype(&aiReleaseImport) release = nullptr;
    decltype(&aiGetErrorString) error = nullptr;
    decltype(&aiCreatePropertyStore) createProperties = nullptr;
    decltype(&aiReleasePropertyStore) releaseProperties = nullptr;
    decltype(&aiSetImportPropertyInteger) setInteger = nullptr;
    std::string reason;  ///< why it cannot be used; empty if it can
};

Library openLibrary() {
    Library library;
    void* handle = ::dlopen(GLINT_ASSIMP_SONAME, RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
        library.reason = fmt::format("assimp's library cannot be opened: {}", ::dlerror());
        return library;
    }
    bool is_complete = true;
    const auto find = [&](auto& function, const char* name) {
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(handle, name));
        is_complete = is_complete && function;
    };
    decltype(&aiGetVersionMajor) major = nullptr;
    decltype(&aiGetVersionMinor) minor = nullptr;
    find(major, "aiGetVersionMajor");
    find(minor, "aiGetVersionMinor");
    find(library.import, "aiImportFileExWithProperties");
    find(library.release, "aiReleaseImport");
    find(library.error, "aiGetErrorString");
    find(library.createProperties, "aiCreatePropertyStore");
    find(library.releaseProperties, "aiReleasePropertyStore");
    find(library.setInteger, "aiSetImportPropertyInteger");
    // Structures differ from version to version.
    const std::string version = is_complete ? fmt::format("{}.{}", major(), minor()) : "";
    if (!is_complete || version != GLINT_ASSIMP_VERSION)
        library.reason = fmt::format("{} is of version {}, this program needs {}", GLINT_ASSIMP_SONAME,
                                     is_complete ? version : "unknown", GLINT_ASSIMP_VERSION);
    return library;
}

const Library& library() {
    static const Library value = openLibrary();
    return value;
}

Vector3f vectorOf(const aiVector3D& v) { return {v.x, v.y, v.z}; }

/// The triangles of a scene whose meshes are in the world already.
Expected<Mesh> collect(const aiScene& scene, uint64_t limit) {
    Mesh mesh;
    uint64_t vertices = 0, triangles = 0;
    bool has_normals = true, has_texcoords = true;
    for (uint32_t i = 0; i < scene.mNumMeshes; i++) {
        const aiMesh& from = *scene.mMeshes[i];
        vertices += from.mNumVertices;
        triangles += from.mNumFaces;
        has_normals = has_normals && from.mNormals;
        has_texcoords = has_texcoords && from.mTextureCoords[0];
    }
    if (vertices * 32 + triangles * 12 > limit || vertices > UINT32_MAX || triangles * 3 > UINT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "mesh.too_large",
                                    "{} vertices and {} triangles take more than the limit of {} bytes", vertices,
                                    triangles, limit));
    for (uint32_t i = 0; i < scene.mNumMeshes; i++) {
        const aiMesh& from = *scene.mMeshes[i];
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        MeshPart part = {.name = from.mName.C_Str(), .first_index = static_cast<uint32_t>(mesh.indices.size())};
        for (uint32_t k = 0; k < from.mNumVertices; k++) {
            mesh.positions.push_back(vectorOf(from.mVertices[k]));
            if (has_normals) {
                // Some files have such of length zero, or none where a triangle has no area.
                const Vector3f normal = vectorOf(from.mNormals[k]);
                const float length = std::hypot(normal.x, normal.y, normal.z);
                mesh.normals.push_back(length > 0.0f && std::isfinite(length) ? normal / length : Vector3f(0, 0, 1));
            }
            if (has_texcoords) mesh.texcoords.emplace_back(from.mTextureCoords[0][k].x, from.mTextureCoords[0][k].y);
        }
        for (uint32_t k = 0; k < from.mNumFaces; k++) {
            if (from.mFaces[k].mNumIndices != 3) continue;  // points and lines
            for (uint32_t c = 0; c < 3; c++) mesh.indices.push_back(first + from.mFaces[k].mIndices[c]);
        }
        part.index_count = static_cast<uint32_t>(mesh.indices.size()) - part.first_index;
        if (part.index_count > 0) mesh.parts.push_back(std::move(part));
    }
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    return mesh;
}

}  // namespace

Expected<Mesh> readThroughAssimp(const std::filesystem::path& path, uint64_t limit) {
    std::error_code failure;
    const uint64_t size = std::filesystem::file_size(path, failure);
    if (failure)
        return unexpected(
            makeError(ErrorCode::Io, "file.open", "cannot open '{}': {}", path.string(), failure.message()));
    if (size > limit)
        return unexpected(makeError(ErrorCode::Io, "file.too_large", "'{}' has {} bytes, the limit is {}",
                                    path.string(), size, limit));
    const Library& assimp = library();
    const std::string name = path.filename().string();
    if (!assimp.reason.empty())
        return unexpected(Error::inFile(ErrorCode::Unsupported, "mesh.library", assimp.reason, name, 0));

    // The library keeps its error in one place for all threads.
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    const std::unique_ptr<aiPropertyStore, decltype(assimp.releaseProperties)> properties(assimp.createProperties(),
                                                                                          assimp.releaseProperties);
    assimp.setInteger(properties.get(), AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const std::unique_ptr<const aiScene, decltype(assimp.release)> scene(
        assimp.import(path.c_str(),
                      aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices |
                          aiProcess_JoinIdenticalVertices,
                      nullptr, properties.get()),
        assimp.release);
    if (!scene)
        return unexpected(Error::inFile(ErrorCode::InvalidArgument, "mesh.assimp",
                                        fmt::format("assimp cannot read it: {}", assimp.error()), name, 0));
    Expected<Mesh> mesh = collect(*scene, limit);
    if (mesh) return mesh;
    const Error& error = mesh.error();
    return unexpected(Error::inFile(error.code(), error.id().data(), error.message(), name, 0));
}

}  // namespace glint::detail
