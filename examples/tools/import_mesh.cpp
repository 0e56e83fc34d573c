// Formats that have no smaller library. assimp is opened when such a file is read: linked, its 10 MB and their
// dependencies would be loaded by every run of the tool.

#include "import_mesh.h"

#include <glint/base/file.h>

#include <fmt/format.h>

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <span>

using namespace glint;

namespace tool {

namespace {

/// The functions of the library that are used.
struct Library {
    decltype(&aiImportFileExWithProperties) import = nullptr;
    decltype(&aiGetErrorString) error = nullptr;
    decltype(&aiCreatePropertyStore) createProperties = nullptr;
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
    find(library.error, "aiGetErrorString");
    find(library.createProperties, "aiCreatePropertyStore");
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
        return unexpected(Error(ErrorCode::OutOfRange, "mesh.too_large",
                                fmt::format("{} vertices and {} triangles take more than the limit of {} bytes",
                                            vertices, triangles, limit)));
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
    return mesh;
}

/// What a child sends: numbers of what follows, then the arrays.
struct Reply {
    uint64_t positions = 0, normals = 0, texcoords = 0, indices = 0, parts = 0, names = 0;
};
struct PartReply {
    uint64_t first_index = 0, index_count = 0, name_size = 0;
};

/// A file without a name, written by one process and read by another.
class Channel {
public:
    Channel() : descriptor_(::memfd_create("glint", MFD_CLOEXEC)) {}
    ~Channel() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    Channel(const Channel&) = delete;
    Channel& operator=(const Channel&) = delete;

    bool isOpen() const { return descriptor_ >= 0; }
    template <class T>
    bool write(std::span<const T> values) {
        const auto bytes = std::as_bytes(values);
        for (size_t done = 0; done < bytes.size();) {
            const ssize_t count = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
            if (count <= 0) return false;
            done += static_cast<size_t>(count);
        }
        return true;
    }
    template <class T>
    bool read(std::vector<T>& values, uint64_t count) {
        if (count > remaining() / sizeof(T)) return false;
        values.resize(count);
        const auto bytes = std::as_writable_bytes(std::span(values));
        for (size_t done = 0; done < bytes.size();) {
            const ssize_t got =
                ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset_ + done));
            if (got <= 0) return false;
            done += static_cast<size_t>(got);
        }
        offset_ += bytes.size();
        return true;
    }
    uint64_t remaining() const {
        struct stat status = {};
        if (::fstat(descriptor_, &status) != 0) return 0;
        return static_cast<uint64_t>(status.st_size) - offset_;
    }

private:
    int descriptor_;
    uint64_t offset_ = 0;
};

bool send(Channel& channel, const Mesh& mesh) {
    std::vector<PartReply> parts;
    std::string names;
    for (const MeshPart& part : mesh.parts) {
        parts.push_back({part.first_index, part.index_count, part.name.size()});
        names += part.name;
    }
    const Reply reply = {mesh.positions.size(), mesh.normals.size(), mesh.texcoords.size(),
                         mesh.indices.size(),   parts.size(),        names.size()};
    return channel.write(std::span(&reply, 1)) && channel.write(std::span<const Vector3f>(mesh.positions)) &&
           channel.write(std::span<const Vector3f>(mesh.normals)) &&
           channel.write(std::span<const Vector2f>(mesh.texcoords)) &&
           channel.write(std::span<const uint32_t>(mesh.indices)) && channel.write(std::span<const PartReply>(parts)) &&
           channel.write(std::span<const char>(names));
}

/// Nothing that the child says is taken on trust: it may have gone wrong before.
bool receive(Channel& channel, Mesh& mesh) {
    std::vector<Reply> reply;
    std::vector<PartReply> parts;
    std::vector<char> names;
    if (!channel.read(reply, 1) || !channel.read(mesh.positions, reply[0].positions) ||
        !channel.read(mesh.normals, reply[0].normals) || !channel.read(mesh.texcoords, reply[0].texcoords) ||
        !channel.read(mesh.indices, reply[0].indices) || !channel.read(parts, reply[0].parts) ||
        !channel.read(names, reply[0].names))
        return false;
    size_t offset = 0;
    for (const PartReply& part : parts) {
        if (part.name_size > names.size() - offset || part.first_index > UINT32_MAX || part.index_count > UINT32_MAX)
            return false;
        mesh.parts.push_back({.name = std::string(names.data() + offset, part.name_size),
                              .first_index = static_cast<uint32_t>(part.first_index),
                              .index_count = static_cast<uint32_t>(part.index_count)});
        offset += part.name_size;
    }
    return true;
}

// Sanitizers reserve terabytes of addresses at any time, and may have a thread of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool is_sanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool is_sanitized = true;
#else
constexpr bool is_sanitized = false;
#endif
#else
constexpr bool is_sanitized = false;
#endif

/// Exit statuses of the child.
enum : int { Sent = 100, Refused, Unsent, TooLarge };  // none that a library ends with

/// In the child: reads the file and sends a mesh, or the text of an error.
int import(const Library& assimp, const std::filesystem::path& path, uint64_t limit, Channel& channel) {
    aiPropertyStore* properties = assimp.createProperties();
    assimp.setInteger(properties, AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = assimp.import(path.c_str(),
                                         aiProcess_Triangulate | aiProcess_SortByPType |
                                             aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices,
                                         nullptr, properties);
    if (!scene) {
        const std::string_view text = assimp.error();
        return channel.write(std::span<const char>(text)) ? Refused : Unsent;
    }
    const Expected<Mesh> mesh = collect(*scene, limit);
    if (mesh) return send(channel, *mesh) ? Sent : Unsent;
    return channel.write(std::span<const char>(mesh.error().message())) ? TooLarge : Unsent;
}

void setLimit(__rlimit_resource resource, uint64_t value) {
    const rlimit limit = {value, value};
    ::setrlimit(resource, &limit);
}

/// Bytes of address space that this process has.
uint64_t addressSpace() {
    const Expected<std::string> text = readTextFile("/proc/self/status");
    const size_t place = text ? text->find("VmSize:") : std::string::npos;
    return place == std::string::npos ? 0 : std::strtoull(text->c_str() + place + 7, nullptr, 10) * 1024;
}

/// Threads that this process has.
size_t threadCount() {
    std::error_code error;
    const std::filesystem::directory_iterator tasks("/proc/self/task", error);
    return error ? 1 : static_cast<size_t>(std::distance(begin(tasks), end(tasks)));
}

}  // namespace

Expected<Mesh> importMesh(const std::filesystem::path& path, uint64_t limit) {
    std::string kind = path.extension().string();
    for (char& c : kind) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (std::ranges::find(import_extensions, kind) == std::end(import_extensions)) return Mesh::load(path, limit);

    const Expected<InputFile> file = InputFile::open(path);
    if (!file) return unexpected(file.error());
    const std::string name = path.filename().string();
    const auto fail = [&](ErrorCode code, const char* id, const std::string& text) {
        return unexpected(Error::inFile(code, id, text, name, 0));
    };
    if (file->size() > limit)
        return fail(ErrorCode::Io, "file.too_large", fmt::format("{} bytes, the limit is {}", file->size(), limit));
    const Library& assimp = library();
    if (!assimp.reason.empty()) return fail(ErrorCode::Unsupported, "tool.library", assimp.reason);
    // What other threads had locked would stay locked in the child.
    if (!is_sanitized && threadCount() > 1)
        return fail(ErrorCode::Internal, "tool.threads", fmt::format("read while there are {} threads", threadCount()));

    // Damaged files make the library crash, or take all memory or time: it does so in a process of its own.
    Channel channel;
    const uint64_t memory = addressSpace() + 2 * limit + (uint64_t{1} << 30);
    const uint64_t seconds = 4 + file->size() / 100'000;
    // A status that nobody keeps could not be waited for.
    std::signal(SIGCHLD, SIG_DFL);
    std::fflush(nullptr);
    const pid_t child = channel.isOpen() ? ::fork() : -1;
    if (child < 0)
        return fail(ErrorCode::OutOfMemory, "tool.import",
                    fmt::format("no process to read it: {}", std::strerror(errno)));
    if (child == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (!is_sanitized) setLimit(RLIMIT_AS, memory);
        setLimit(RLIMIT_CPU, seconds);
        setLimit(RLIMIT_CORE, 0);
        const int nowhere = ::open("/dev/null", O_WRONLY);
        if (nowhere >= 0) {
            ::dup2(nowhere, STDOUT_FILENO);
            ::dup2(nowhere, STDERR_FILENO);
        }
        ::_exit(import(assimp, path, limit, channel));
    }
    int status = 0;
    pid_t waited = -1;
    while ((waited = ::waitpid(child, &status, 0)) < 0 && errno == EINTR) {}
    if (waited < 0)
        return fail(ErrorCode::Internal, "tool.import",
                    fmt::format("it is not known how assimp ended: {}", std::strerror(errno)));
    if (WIFSIGNALED(status)) {
        const int signal = WTERMSIG(status);
        if (signal == SIGXCPU || signal == SIGKILL)
            return fail(ErrorCode::InvalidArgument, "tool.import",
                        fmt::format("assimp has taken longer than {} s of a processor, or too much memory", seconds));
        return fail(ErrorCode::InvalidArgument, "tool.import", fmt::format("assimp crashes: {}", ::strsignal(signal)));
    }
    if (WEXITSTATUS(status) == Refused || WEXITSTATUS(status) == TooLarge) {
        std::vector<char> letters;
        channel.read(letters, channel.remaining());
        const std::string text(letters.begin(), letters.end());
        if (WEXITSTATUS(status) == TooLarge) return fail(ErrorCode::OutOfRange, "mesh.too_large", text);
        return fail(ErrorCode::InvalidArgument, "tool.import", text);
    }
    Mesh mesh;
    if (WEXITSTATUS(status) != Sent || !receive(channel, mesh))
        return fail(ErrorCode::OutOfMemory, "tool.import", "what assimp has read cannot be taken over");
    if (Status valid = mesh.validate(); !valid)
        return fail(valid.error().code(), valid.error().id().data(), valid.error().message());
    return mesh;
}

}  // namespace tool
