// Any bytes as a PLY file of splats: an error, or splats that are valid, counted, and the same when written and read.

#include "fuzz.h"

#include <glint/format/splats.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    SplatReport report;
    const Expected<Splats> splats = parsePlySplats(fuzz::bytesOf(data, size), "fuzz.ply", fuzz::limit, &report);
    if (!splats) return 0;
    fuzz::require(static_cast<bool>(splats->validate()));
    fuzz::require(report.splats == splats->size() + report.dropped.total());
    const Expected<Splats> again = parsePlySplats(encodePlySplats(*splats).value(), "fuzz.ply");
    fuzz::require(again && again->positions == splats->positions && again->harmonics == splats->harmonics);
    return 0;
}
