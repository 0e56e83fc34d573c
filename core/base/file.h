#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// Reads a whole file. Errors: "file.open", "file.read", "file.too_large" (more than `limit` bytes).
Expected<std::vector<std::byte>> readFile(const std::filesystem::path& path, uint64_t limit = 1ull << 40);
Expected<std::string> readTextFile(const std::filesystem::path& path, uint64_t limit = 1ull << 30);

/// Writes a file so that its final name never holds half of it: a temporary beside it, then a rename.
/// Safe under concurrent processes. Errors: "file.create", "file.write".
Status writeFile(const std::filesystem::path& path, std::span<const std::byte> bytes);
Status writeTextFile(const std::filesystem::path& path, std::string_view text);

}  // namespace glint
