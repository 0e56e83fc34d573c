#include "fuzz.h"

#include <glint/format/image.h>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<Image> image = decodeJpeg(fuzz::bytesOf(data, size), fuzz::limit);
    if (image) fuzz::require(image->bytes().size() <= fuzz::limit);
    return 0;
}
