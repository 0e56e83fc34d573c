#pragma once

// What the harnesses share. Each is one function that libFuzzer calls with bytes of its own making, and that a plain
// program (replay.cpp) calls with the files of the corpus.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace glint::fuzz {

/// What a reader may make of one input: enough for every branch, too little to spend time in.
constexpr uint64_t limit = 1 << 20;

inline std::span<const std::byte> bytesOf(const uint8_t* data, size_t size) {
    return std::as_bytes(std::span(data, size));
}

/// What must be true whatever the input. Ends the program, so that libFuzzer keeps the input.
inline void require(bool condition) {
    if (!condition) std::abort();
}

}  // namespace glint::fuzz
