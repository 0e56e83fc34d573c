#include "fuzz.h"

#include "../support/png_chunks.h"

#include <glint/format/image.h>

#include <algorithm>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<Image> image = decodePng(fuzz::bytesOf(data, size), fuzz::limit);
    if (image) fuzz::require(decodePng(encodePng(*image).value()).value().bytes().size() == image->bytes().size());
    return 0;
}

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

// Without right checksums nothing behind them would be reached.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned int seed) {
    size = LLVMFuzzerMutate(data, size, max_size);
    if (seed % 8 == 0) return size;
    const std::span<const std::byte> mutated = fuzz::bytesOf(data, size);
    std::vector<std::byte> png(mutated.begin(), mutated.end());
    test::repairChecksums(png);
    std::copy(png.begin(), png.end(), reinterpret_cast<std::byte*>(data));
    return size;
}
