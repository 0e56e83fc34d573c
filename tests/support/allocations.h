#pragma once

#include <cstdint>

namespace glint::test {

/// Calls of operator new and operator delete in this program so far, all threads together. A program that calls
/// allocations() gets counting operators instead of the standard ones; one that does not keeps those.
/// C libraries' malloc and drivers' own allocations are not counted.
struct Allocations {
    uint64_t made = 0;
    uint64_t released = 0;
    uint64_t live() const { return made - released; }
};

Allocations allocations();

/// Bytes of physical memory that this process holds now.
uint64_t residentMemory();

}  // namespace glint::test
