#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace glint::bench {

/// Counts the heap allocations of one thread between begin() and end(), malloc and operator new alike, by who asked for
/// them: this program, which Glint is linked into, or a library that it called, such as the driver and its compiler.
class AllocationCounter {
public:
    struct Counts {
        uint64_t program = 0;
        uint64_t libraries = 0;
    };

    /// Learns which code belongs to whom: call it once the driver is loaded. False where allocations cannot be seen,
    /// as in a sanitizer's build.
    static bool prepare();

    static void begin();
    static void end();
    static void reset();
    static Counts counts();
    /// Call stacks of the first few allocations of the program since reset(), as module+offset, for addr2line.
    static std::vector<std::string> stacks();
};

}  // namespace glint::bench
