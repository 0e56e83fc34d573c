#pragma once

#include <cstdint>
#include <functional>

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

/// By how many bytes the physical memory of this process grows at most while `run` runs, C libraries' included. Pages
/// that are asked for and never touched do not count. 0 where the system does not tell, and under sanitizers, which
/// take memory of their own.
uint64_t peakMemory(const std::function<void()>& run);

}  // namespace glint::test
