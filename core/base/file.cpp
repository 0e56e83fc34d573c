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
    const Expected<InputFile> file = InputFile::open(path);
    if (!file) return unexpected(file.error());
    if (file->size() > limit)
        return unexpected(makeError(ErrorCode::Io, "file.too_large", "'{}' has {} bytes, the limit is {}",
                                    path.string(), file->size(), limit));
    Bytes bytes;
    bytes.resize(file->size());
    if (Status status = file->read(0, std::as_writable_bytes(std::span(bytes))); !status)
        return unexpected(status.error());
    return bytes;
}

}  // namespace

Expected<InputFile> InputFile::open(const std::filesystem::path& path) {
    std::error_code failure;
    if (std::filesystem::is_directory(path, failure))
        return unexpected(makeError(ErrorCode::Io, "file.open", "cannot read '{}': it is a directory", path.string()));
    InputFile result;
    result.name_ = path.string();
    result.file_ = FilePtr(std::fopen(path.c_str(), "rb"));
    if (!result.file_)
        return unexpected(
            makeError(ErrorCode::Io, "file.open", "cannot open '{}': {}", path.string(), std::strerror(errno)));
    result.size_ = std::filesystem::file_size(path, failure);
    if (failure)
        return unexpected(
            makeError(ErrorCode::Io, "file.read", "cannot size '{}': {}", path.string(), failure.message()));
    return result;
}

Status InputFile::read(uint64_t offset, std::span<std::byte> destination) const {
    const int descriptor = ::fileno(file_.get());
    for (size_t done = 0; done < destination.size();) {
        const ssize_t count = ::pread(descriptor, destination.data() + done, destination.size() - done,
                                      static_cast<off_t>(offset + done));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0)
            return makeError(ErrorCode::Io, "file.read", "cannot read byte {} of '{}': {}", offset + done, name_,
                             count < 0 ? std::strerror(errno) : "the file ends there");
        done += static_cast<size_t>(count);
    }
    return {};
}

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
