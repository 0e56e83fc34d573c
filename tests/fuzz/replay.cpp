// Runs a harness on files, where there is no libFuzzer: `FORMAT_fuzz FILE|FOLDER...`.

#include "fuzz.h"

#include <glint/base/file.h>

#include <cstdio>
#include <filesystem>
#include <vector>

// png_fuzz.cpp asks libFuzzer for it.
extern "C" size_t LLVMFuzzerMutate(uint8_t*, size_t size, size_t) { return size; }

namespace {

bool replay(const std::filesystem::path& path) {
    const glint::Expected<std::vector<std::byte>> bytes = glint::readFile(path);
    if (!bytes) {
        std::fprintf(stderr, "%s\n", bytes.error().text().c_str());
        return false;
    }
    LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size());
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    int files = 0;
    for (int i = 1; i < argc; i++) {
        std::vector<std::filesystem::path> paths = {argv[i]};
        if (std::filesystem::is_directory(argv[i]))
            paths.assign(std::filesystem::directory_iterator(argv[i]), std::filesystem::directory_iterator());
        for (const std::filesystem::path& path : paths) {
            if (!replay(path)) return 1;
            files++;
        }
    }
    std::printf("%d files\n", files);
    return files > 0 ? 0 : 1;
}
