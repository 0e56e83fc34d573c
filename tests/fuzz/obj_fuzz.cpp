#include "fuzz.h"

#include <glint/base/log.h>
#include <glint/format/mesh.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    [[maybe_unused]] static const bool is_silent = [] {
        setLogCallback([](LogLevel, std::string_view, std::string_view) {});
        return true;
    }();
    const Expected<Mesh> mesh = parseObj({reinterpret_cast<const char*>(data), size}, "fuzz.obj", fuzz::limit);
    if (mesh) fuzz::require(static_cast<bool>(mesh->validate()));
    return 0;
}
