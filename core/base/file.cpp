#include <glint/base/file.h>

#include <glint/base/format_error.h>

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace glint {

namespace {

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePtr = std::unique_ptr<std::FILE, FileCloser>;

template <class Bytes>
Expected<Bytes> readAll(const std::filesystem::path& path, uint64_t limit) {
    std::error_code failure;
    if (std::filesystem::is_directory(path, failure))
        return unexpected(makeError(ErrorCode::Io, "file.open", "cannot read '{}': it is a directory", path.string()));
    FilePtr file(std::fopen(path.c_str(), "rb"));
    if (!file)
        return unexpected(
            makeError(ErrorCode::Io, "file.open", "cannot open '{}': {}", path.string(), std::strerror(errno)));
    const uint64_t size = std::filesystem::file_size(path, failure);
    if (failure)
        return unexpected(
            makeError(ErrorCode::Io, "file.read", "cannot size '{}': {}", path.string(), failure.message()));
    if (size > limit)
        return unexpected(makeError(ErrorCode::Io, "file.too_large", "'{}' has {} bytes, the limit is {}",
                                    path.string(), size, limit));
    Bytes bytes;
    bytes.resize(size);
    if (size != 0 && std::fread(bytes.data(), 1, size, file.get()) != size)
        return unexpected(makeError(ErrorCode::Io, "file.read", "cannot read {} bytes of '{}'", size, path.string()));
    return bytes;
}

}  // namespace

Expected<std::vector<std::byte>> readFile(const std::filesystem::path& path, uint64_t limit) {
    return readAll<std::vector<std::byte>>(path, limit);
}

Expected<std::string> readTextFile(const std::filesystem::path& path, uint64_t limit) {
    return readAll<std::string>(path, limit);
}

Status writeFile(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    static std::atomic<uint32_t> counter = 0;
    const std::filesystem::path temporary = path.string() + fmt::format(".{}.{}.tmp", ::getpid(), counter.fetch_add(1));
    FilePtr file(std::fopen(temporary.c_str(), "wb"));
    if (!file)
        return makeError(ErrorCode::Io, "file.create", "cannot create '{}': {}", path.string(), std::strerror(errno));
    // An empty span may have no address, which the C library does not take.
    const bool written = bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
    const bool closed = std::fclose(file.release()) == 0;
    std::error_code failure;
    if (written && closed) std::filesystem::rename(temporary, path, failure);
    if (!written || !closed || failure) {
        const std::string reason = failure ? failure.message() : std::strerror(errno);
        std::filesystem::remove(temporary, failure);
        return makeError(ErrorCode::Io, "file.write", "cannot write {} bytes to '{}': {}", bytes.size(), path.string(),
                         reason);
    }
    return {};
}

Status writeTextFile(const std::filesystem::path& path, std::string_view text) {
    return writeFile(path, std::as_bytes(std::span(text)));
}

}  // namespace glint
