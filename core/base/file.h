#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// Reads a whole file. Errors: "file.open", "file.read", "file.too_large" (more than `limit` bytes).
Expected<std::vector<std::byte>> readFile(const std::filesystem::path& path, uint64_t limit = 1ull << 40);
Expected<std::string> readTextFile(const std::filesystem::path& path, uint64_t limit = 1ull << 30);

/// A file that is read in pieces, from any thread. A value: copies share the open file.
class InputFile {
public:
    /// Errors: "file.open", "file.read" (its size is not known).
    static Expected<InputFile> open(const std::filesystem::path& path);

    /// Bytes, when it was opened.
    uint64_t size() const { return size_; }

    /// Fills `destination` with the bytes from `offset` on. Errors: "file.read" (also where the file has ended).
    Status read(uint64_t offset, std::span<std::byte> destination) const;

private:
    std::shared_ptr<std::FILE> file_;
    uint64_t size_ = 0;
    std::string name_;
};

/// Writes a file so that its final name never holds half of it: a temporary beside it, then a rename.
/// Safe under concurrent processes. Errors: "file.create", "file.write".
Status writeFile(const std::filesystem::path& path, std::span<const std::byte> bytes);
Status writeTextFile(const std::filesystem::path& path, std::string_view text);

}  // namespace glint
