// Any bytes as a .splat file: an error, or splats that are valid, counted, and the same when written and read again.

#include "fuzz.h"

#include <glint/format/splats.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    SplatReport report;
    const Expected<Splats> splats = parseDotSplat(fuzz::bytesOf(data, size), "fuzz.splat", fuzz::limit, &report);
    if (!splats) return 0;
    fuzz::require(static_cast<bool>(splats->validate()));
    fuzz::require(report.splats == size / 32 && report.splats == splats->size() + report.dropped.total());
    const Expected<Splats> again = parseDotSplat(encodeDotSplat(*splats).value(), "fuzz.splat");
    fuzz::require(again && again->positions == splats->positions && again->scales == splats->scales);
    return 0;
}
