#include "shader_source.h"

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/shader/embedded.h>

#include <sys/stat.h>

#include <map>
#include <mutex>
#include <shared_mutex>

namespace glint {

namespace {

constexpr uint64_t max_include_size = 16ull << 20;

struct MemoryIncludes {
    std::shared_mutex mutex;
    std::map<std::string, std::shared_ptr<const std::string>, std::less<>> texts;
};

MemoryIncludes& memoryIncludes() {
    // Never destroyed: background compilations may still run while static objects are.
    static MemoryIncludes& instance = *new MemoryIncludes;
    return instance;
}

}  // namespace

void setShaderInclude(std::string_view name, std::string_view text) {
    MemoryIncludes& includes = memoryIncludes();
    std::unique_lock lock(includes.mutex);
    if (!text.empty()) {
        includes.texts.insert_or_assign(std::string(name), std::make_shared<const std::string>(text));
    } else if (const auto found = includes.texts.find(name); found != includes.texts.end()) {
        includes.texts.erase(found);
    }
}

FileStamp stampFile(const std::filesystem::path& path) {
    FileStamp stamp{.path = path, .time = -1, .size = 0};
    struct stat info = {};
    if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return stamp;
    stamp.time = static_cast<int64_t>(info.st_mtim.tv_sec) * 1'000'000'000 + info.st_mtim.tv_nsec;
    stamp.size = static_cast<uint64_t>(info.st_size);
    return stamp;
}

bool filesChanged(std::span<const FileStamp> stamps) {
    for (const FileStamp& stamp : stamps)
        if (stampFile(stamp.path) != stamp) return true;
    return false;
}

namespace shader {

std::string diskIdentity(const std::filesystem::path& path) {
    std::error_code failure;
    const std::filesystem::path absolute = std::filesystem::absolute(path, failure);
    return "disk:" + (failure ? path : absolute).lexically_normal().string();
}

namespace {

using Found = Expected<std::optional<Included>>;

Found findInMemory(const std::string& name) {
    MemoryIncludes& includes = memoryIncludes();
    std::shared_lock lock(includes.mutex);
    const auto found = includes.texts.find(name);
    if (found == includes.texts.end()) return std::nullopt;
    return Included{.name = name,
                    .identity = "memory:" + name,
                    .text = found->second,
                    .origin = Included::Origin::Memory,
                    .stamp = {}};
}

Found findOnDisk(const std::filesystem::path& path) {
    const std::filesystem::path normal = path.lexically_normal();
    FileStamp stamp = stampFile(normal);
    if (stamp.time < 0) return std::nullopt;
    Expected<std::string> text = readTextFile(normal, max_include_size);
    if (!text) return unexpected(text.error());
    return Included{.name = normal.string(),
                    .identity = diskIdentity(normal),
                    .text = std::make_shared<const std::string>(std::move(*text)),
                    .origin = Included::Origin::Disk,
                    .stamp = std::move(stamp)};
}

Found findEmbedded(const std::string& name) {
    static constexpr std::string_view prefix = "glint/";
    if (!name.starts_with(prefix)) return std::nullopt;
    for (const EmbeddedFile& file : embeddedShaders()) {
        if (std::string_view(name).substr(prefix.size()) != file.name) continue;
        return Included{.name = name,
                        .identity = "embedded:" + name,
                        .text = std::make_shared<const std::string>(file.text, file.size),
                        .origin = Included::Origin::Embedded,
                        .stamp = {}};
    }
    return std::nullopt;
}

std::string beside(const std::string& file, std::string_view name) {
    return (std::filesystem::path(file).parent_path() / name).lexically_normal().string();
}

}  // namespace

Expected<std::optional<Included>> findInclude(const ShaderSource& source, std::string_view name, bool quoted,
                                              const Included& from) {
    const std::string text(name);
    Found found = findInMemory(text);
    if (found && !*found && quoted) {
        switch (from.origin) {
            case Included::Origin::Memory: found = findInMemory(beside(from.name, name)); break;
            case Included::Origin::Disk: found = findOnDisk(beside(from.name, name)); break;
            case Included::Origin::Embedded: found = findEmbedded(beside(from.name, name)); break;
        }
    }
    for (const std::filesystem::path& folder : source.include_paths) {
        if (!found || *found) return found;
        found = findOnDisk(folder / name);
    }
    if (found && !*found) found = findEmbedded(std::filesystem::path(name).lexically_normal().string());
    return found;
}

}  // namespace shader

}  // namespace glint
