// The GLSL files that the library carries with it: everything below shaders/, as it was when the library was built.
#pragma once

#include <cstddef>
#include <span>

namespace glint {

/// One of these files.
struct EmbeddedFile {
    const char* name;  ///< relative to shaders/, with forward slashes
    const char* text;  ///< ends with a zero that `size` does not count
    size_t size;       ///< bytes
};

/// In order of their names; valid for the life of the program. May be called from any thread.
std::span<const EmbeddedFile> embeddedShaders();

}  // namespace glint
