#pragma once

// For sources only: the disk cache of compiled shaders.

#include <glint/base/hash.h>
#include <glint/shader/shader_compiler.h>

#include <optional>

namespace glint::shader {

/// What a cache file holds: the module and its reflection, `files` and `stamps` are not part of it.
std::vector<std::byte> encodeShader(const CompiledShader& shader);
/// Nothing if the bytes are not exactly what encodeShader makes.
std::optional<CompiledShader> decodeShader(std::span<const std::byte> bytes);

/// The folder that is used unless setShaderCache names another, as the environment says now.
std::filesystem::path defaultCacheFolder();

/// What every key begins with: the versions of the compilers and of what is done with their results.
Hash toolHash();

/// Takes an entry from the cache and marks it as used. A damaged one counts as absent.
std::optional<CompiledShader> loadFromCache(const Hash& key);

/// Puts an entry in, removing the least recently used ones if the folder would grow beyond its limit. What fails is
/// logged, once for each folder.
void storeInCache(const Hash& key, const CompiledShader& shader);

}  // namespace glint::shader
