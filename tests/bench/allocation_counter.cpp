#include "bench/allocation_counter.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <string_view>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GLINT_COUNTS_ALLOCATIONS 0
#else
#define GLINT_COUNTS_ALLOCATIONS 1
#endif

namespace {

enum class Owner { Runtime, Program, Library };

struct Range {
    uintptr_t begin = 0;
    uintptr_t end = 0;
    Owner owner = Owner::Library;
};

constexpr size_t max_ranges = 256;
constexpr size_t max_frames = 64;
constexpr size_t max_stacks = 8;

struct Stack {
    std::array<void*, max_frames> frames = {};
    int count = 0;
};

// Written by prepare() before any thread counts, then by the one counting thread. Nothing here may allocate.
std::array<Range, max_ranges> ranges;
size_t range_count = 0;
glint::bench::AllocationCounter::Counts found;
std::array<Stack, max_stacks> stacks_found;
size_t stack_count = 0;

thread_local bool counting = false;
thread_local bool inside = false;

Owner ownerOf(std::string_view path) {
    if (path.empty() || path.find("/libglint") != std::string_view::npos) return Owner::Program;
    // They allocate on behalf of whoever called them: std::string does so in libstdc++.
    for (const std::string_view runtime : {"/libc.so", "/libstdc++", "/libgcc_s", "/libm.so", "/libfmt", "/ld-linux"}) {
        if (path.find(runtime) != std::string_view::npos) return Owner::Runtime;
    }
    return Owner::Library;
}

int addRanges(dl_phdr_info* info, size_t, void*) {
    for (int i = 0; i < info->dlpi_phnum && range_count < max_ranges; i++) {
        const auto& header = info->dlpi_phdr[i];
        if (header.p_type != PT_LOAD || (header.p_flags & PF_X) == 0) continue;
        const uintptr_t begin = info->dlpi_addr + header.p_vaddr;
        ranges[range_count++] = {begin, begin + header.p_memsz, ownerOf(info->dlpi_name)};
    }
    return 0;
}

Owner ownerOf(void* address) {
    const auto value = reinterpret_cast<uintptr_t>(address);
    const Range* const begin = ranges.data();
    const Range* const end = begin + range_count;
    const Range* const range =
        std::find_if(begin, end, [&](const Range& each) { return value >= each.begin && value < each.end; });
    return range == end ? Owner::Library : range->owner;
}

// The innermost frame outside of the runtime asked for the memory; the first frames are this file's.
[[gnu::noinline]] void note() {
    if (!counting || inside) return;
    inside = true;
    constexpr int own_frames = 2;
    Stack stack;
    stack.count = ::backtrace(stack.frames.data(), static_cast<int>(stack.frames.size()));
    int frame = own_frames;
    while (frame < stack.count && ownerOf(stack.frames[static_cast<size_t>(frame)]) == Owner::Runtime) frame++;
    if (frame < stack.count && ownerOf(stack.frames[static_cast<size_t>(frame)]) == Owner::Program) {
        found.program++;
        if (stack_count < max_stacks) stacks_found[stack_count++] = stack;
    } else {
        found.libraries++;
    }
    inside = false;
}

}  // namespace

#if GLINT_COUNTS_ALLOCATIONS

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier): the C library's names
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
// NOLINTEND(bugprone-reserved-identifier)

// Over the C library's: operator new ends here too, and what it returns may go to the C library's free.
[[gnu::noinline]] void* malloc(size_t size) noexcept {
    if (counting) note();
    return __libc_malloc(size);
}
[[gnu::noinline]] void* calloc(size_t count, size_t size) noexcept {
    if (counting) note();
    return __libc_calloc(count, size);
}
[[gnu::noinline]] void* realloc(void* memory, size_t size) noexcept {
    if (counting) note();
    return __libc_realloc(memory, size);
}
[[gnu::noinline]] void* aligned_alloc(size_t alignment, size_t size) noexcept {
    if (counting) note();
    return __libc_memalign(alignment, size);
}
[[gnu::noinline]] int posix_memalign(void** memory, size_t alignment, size_t size) noexcept {
    if (counting) note();
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : ENOMEM;
}

}  // extern "C"

#endif

namespace glint::bench {

bool AllocationCounter::prepare() {
    range_count = 0;
    ::dl_iterate_phdr(addRanges, nullptr);
    // The first call loads the unwinder, which allocates.
    Stack stack;
    stack.count = ::backtrace(stack.frames.data(), static_cast<int>(stack.frames.size()));
    return GLINT_COUNTS_ALLOCATIONS != 0;
}

void AllocationCounter::begin() { counting = true; }
void AllocationCounter::end() { counting = false; }

void AllocationCounter::reset() {
    found = {};
    stack_count = 0;
}

AllocationCounter::Counts AllocationCounter::counts() { return found; }

std::vector<std::string> AllocationCounter::stacks() {
    std::vector<std::string> texts;
    for (size_t i = 0; i < stack_count; i++) {
        std::string text;
        for (int frame = 0; frame < stacks_found[i].count; frame++) {
            void* address = stacks_found[i].frames[static_cast<size_t>(frame)];
            Dl_info info = {};
            if (!::dladdr(address, &info)) continue;
            const std::string_view path = info.dli_fname;
            text += fmt::format("{}+{:#x} ", path.substr(path.rfind('/') + 1),
                                reinterpret_cast<uintptr_t>(address) - reinterpret_cast<uintptr_t>(info.dli_fbase));
        }
        texts.push_back(std::move(text));
    }
    return texts;
}

}  // namespace glint::bench
