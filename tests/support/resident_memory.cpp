#include "support/allocations.h"

#include <unistd.h>

#include <fstream>

uint64_t glint::test::residentMemory() {
    std::ifstream file("/proc/self/statm");
    uint64_t total = 0;
    uint64_t resident = 0;
    file >> total >> resident;
    return resident * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
}
