// Any bytes as an .npy file. What is read is written and read again: both must agree.

#include <glint/format/npy.h>

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto array = glint::decodeNpy(std::as_bytes(std::span(data, size)), 1u << 20);
    if (!array) return 0;
    const auto file = glint::encodeNpy(array->header, array->data);
    // Control characters in names are read and not written.
    if (!file) return 0;
    const auto again = glint::decodeNpy(*file);
    if (!again || *again != *array) std::abort();
    return 0;
}
