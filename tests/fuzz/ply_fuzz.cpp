#include "fuzz.h"

#include <glint/format/mesh.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<Mesh> mesh = parsePly(fuzz::bytesOf(data, size), "fuzz.ply", fuzz::limit);
    if (!mesh) return 0;
    fuzz::require(static_cast<bool>(mesh->validate()));
    const Expected<Mesh> again = parsePly(encodePly(*mesh).value(), "fuzz.ply");
    fuzz::require(again && again->positions == mesh->positions && again->texcoords == mesh->texcoords &&
                  again->indices == mesh->indices);
    return 0;
}
