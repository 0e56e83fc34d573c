// Any bytes as an .spz file, and packed into one, without which few would be reached: an error, or splats that are
// valid and counted, and can be written and read again.

#include "fuzz.h"

#include <glint/format/splats.h>

#include <zlib.h>

#include <vector>

using namespace glint;

namespace {

std::vector<std::byte> gzip(const uint8_t* data, size_t size) {
    z_stream stream = {};
    fuzz::require(::deflateInit2(&stream, 1, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY) == Z_OK);
    std::vector<std::byte> packed(::deflateBound(&stream, size) + 32);
    stream.next_in = const_cast<Bytef*>(data);
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    fuzz::require(::deflate(&stream, Z_FINISH) == Z_STREAM_END);
    packed.resize(stream.total_out);
    ::deflateEnd(&stream);
    return packed;
}

void read(std::span<const std::byte> file) {
    SplatReport report;
    const Expected<Splats> splats = parseSpz(file, "fuzz.spz", fuzz::limit, &report);
    if (!splats) return;
    fuzz::require(static_cast<bool>(splats->validate()));
    fuzz::require(report.splats == splats->size() + report.dropped.total());
    const Expected<std::vector<std::byte>> written = encodeSpz(*splats);
    const Expected<Splats> again = written ? parseSpz(*written, "fuzz.spz") : unexpected(written.error());
    // The one position that has no opposite: -2^23 becomes 2^23 by the turn of the axes.
    fuzz::require(again ? again->size() == splats->size() : again.error().id() == "splats.range");
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    read(fuzz::bytesOf(data, size));
    read(gzip(data, size));
    return 0;
}
