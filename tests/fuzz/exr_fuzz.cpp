#include "fuzz.h"

#include <glint/format/image.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<Image> image = decodeExr(fuzz::bytesOf(data, size), fuzz::limit);
    if (image) fuzz::require(decodeExr(encodeExr(*image).value()).value() == *image);
    return 0;
}
