#include "fuzz.h"

#include <glint/format/image.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<Image> image = decodeHdr(fuzz::bytesOf(data, size), fuzz::limit);
    if (!image) return 0;
    // What was read can be written, and then nothing is left to round.
    const Image again = decodeHdr(encodeHdr(*image).value()).value();
    fuzz::require(decodeHdr(encodeHdr(again).value()).value() == again);
    return 0;
}
