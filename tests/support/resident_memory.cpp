#include "support/allocations.h"

#include <malloc.h>
#include <unistd.h>

#include <fstream>
#include <string>

uint64_t glint::test::residentMemory() {
    std::ifstream file("/proc/self/statm");
    uint64_t total = 0;
    uint64_t resident = 0;
    file >> total >> resident;
    return resident * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

uint64_t glint::test::peakMemory(const std::function<void()>& run) {
    run();
    return 0;
}

#else

uint64_t glint::test::peakMemory(const std::function<void()>& run) {
    ::malloc_trim(0);
    const uint64_t before = residentMemory();
    // 5: the largest size so far is forgotten.
    if (!(std::ofstream("/proc/self/clear_refs") << 5 << std::flush)) return run(), 0;
    run();
    std::ifstream file("/proc/self/status");
    for (std::string word; file >> word;) {
        uint64_t kibibytes = 0;
        if (word == "VmHWM:" && file >> kibibytes) return kibibytes * 1024 > before ? kibibytes * 1024 - before : 0;
    }
    return 0;
}

#endif
