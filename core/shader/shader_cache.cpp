#include "shader_cache.h"

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/base/log.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <mutex>
#include <thread>

namespace glint {

namespace {

/// Where the cache is; constant once made, so that threads share it without a lock.
struct CacheFolder {
    std::filesystem::path path;  ///< empty: no cache
    uint64_t limit = 0;
    mutable std::once_flag complained;
};

struct CacheState {
    std::mutex mutex;
    std::shared_ptr<const CacheFolder> folder;
};

CacheState& cacheState() {
    // Never destroyed: background compilations may still run while static objects are.
    static CacheState& instance = *new CacheState;
    return instance;
}

std::shared_ptr<const CacheFolder> makeFolder(std::filesystem::path path, uint64_t limit) {
    auto folder = std::make_shared<CacheFolder>();
    folder->path = std::move(path);
    folder->limit = limit;
    return folder;
}

std::shared_ptr<const CacheFolder> cacheFolder() {
    std::lock_guard lock(cacheState().mutex);
    if (!cacheState().folder) cacheState().folder = makeFolder(shader::defaultCacheFolder(), 256ull << 20);
    return cacheState().folder;
}

/// A descriptor that is closed with its scope.
class Descriptor {
public:
    Descriptor(const std::filesystem::path& path, int flags) : value_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    explicit operator bool() const { return value_ >= 0; }
    int get() const { return value_; }

private:
    int value_;
};

/// What an entry's file begins with.
struct EntryHeader {
    std::array<char, 8> magic = {'G', 'L', 'I', 'N', 'T', 'S', 'H', '1'};
    uint64_t size = 0;  ///< of what follows
    Hash key;
    Hash content;
};

constexpr std::string_view suffix = ".glint";
constexpr size_t name_length = 32 + suffix.size();

/// Entries alone are counted and removed: the folder may hold other things.
bool isEntry(std::string_view name) {
    return name.size() == name_length && name.ends_with(suffix) &&
           name.find_first_not_of("0123456789abcdef") == name_length - suffix.size();
}

/// What writeFile leaves behind when its process is killed.
bool isLeftover(std::string_view name) {
    return name.size() > name_length && isEntry(name.substr(0, name_length)) && name.ends_with(".tmp");
}

std::filesystem::path entryPath(const CacheFolder& folder, const Hash& key) {
    return folder.path / (key.hex() + std::string(suffix));
}

/// The folder's lock, and the sum of its entries' sizes, kept in the locked file so that a store need not look at them
/// all. The sum is only ever too high (a file that somebody else removed), and a scan sets it right.
class Ledger {
public:
    explicit Ledger(const CacheFolder& folder)
        : folder_(folder), file_(folder.path / "glint.ledger", O_RDWR | O_CREAT) {
        if (!file_) return;
        // A stopped process must not stop all others: without the lock there is no storing, and no harm.
        for (int attempt = 0; attempt < 200; attempt++) {
            locked_ = ::flock(file_.get(), LOCK_EX | LOCK_NB) == 0;
            if (locked_ || errno != EWOULDBLOCK) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        if (locked_) readTotal();
    }

    explicit operator bool() const { return locked_; }
    uint64_t total() const { return total_; }

    /// Before files come and after they have gone, so that a process killed in between leaves a sum too high.
    bool setTotal(uint64_t total) {
        total_ = total;
        const std::string text = fmt::format("{:020}\n", total);
        return ::pwrite(file_.get(), text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
    }

    /// Removes the entries used least recently until `room` bytes at most are left; counts what is there.
    void evict(uint64_t room) {
        struct Entry {
            std::filesystem::path path;
            FileStamp stamp;
        };
        std::vector<Entry> entries;
        uint64_t sum = 0;
        const int64_t now = std::time(nullptr);
        std::error_code failure;
        std::filesystem::directory_iterator files(folder_.path, failure), end;
        for (; !failure && files != end; files.increment(failure)) {
            const std::string name = files->path().filename().string();
            const FileStamp stamp = stampFile(files->path());
            std::error_code ignored;
            if (isEntry(name) && stamp.time >= 0) {
                entries.push_back({files->path(), stamp});
                sum += stamp.size;
            } else if (isLeftover(name) && stamp.time >= 0 && now - stamp.time / 1'000'000'000 > 600) {
                std::filesystem::remove(files->path(), ignored);
            }
        }
        std::sort(entries.begin(), entries.end(),
                  [](const Entry& a, const Entry& b) { return a.stamp.time < b.stamp.time; });
        for (const Entry& entry : entries) {
            if (sum <= room) break;
            std::error_code ignored;
            if (std::filesystem::remove(entry.path, ignored)) sum -= entry.stamp.size;
        }
        setTotal(sum);
    }

private:
    void readTotal() {
        std::array<char, 32> text = {};
        const ssize_t size = ::pread(file_.get(), text.data(), text.size(), 0);
        const auto [end, error] = std::from_chars(text.data(), text.data() + std::max<ssize_t>(size, 0), total_);
        if (error != std::errc() || *end != '\n') evict(UINT64_MAX);
    }

    const CacheFolder& folder_;
    Descriptor file_;
    bool locked_ = false;
    uint64_t total_ = 0;
};

}  // namespace

void setShaderCache(const std::filesystem::path& folder, uint64_t limit) {
    std::shared_ptr<const CacheFolder> made = makeFolder(folder, limit);
    std::lock_guard lock(cacheState().mutex);
    cacheState().folder = std::move(made);
}

namespace shader {

std::filesystem::path defaultCacheFolder() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::filesystem::path(value ? value : "");
    };
    if (std::getenv("GLINT_CACHE")) return variable("GLINT_CACHE");
    if (const auto base = variable("XDG_CACHE_HOME"); !base.empty()) return base / "glint";
    if (const auto home = variable("HOME"); !home.empty()) return home / ".cache" / "glint";
    return {};
}

std::optional<CompiledShader> loadFromCache(const Hash& key) {
    const std::shared_ptr<const CacheFolder> folder = cacheFolder();
    if (folder->path.empty()) return {};
    const std::filesystem::path path = entryPath(*folder, key);
    const Descriptor file(path, O_RDONLY);
    struct stat info = {};
    if (!file || ::fstat(file.get(), &info) != 0) return {};

    const EntryHeader expected;
    EntryHeader header;
    std::optional<CompiledShader> result;
    const auto size = static_cast<uint64_t>(info.st_size);
    if (size >= sizeof(header) && size - sizeof(header) <= folder->limit) {
        std::vector<std::byte> bytes(size);
        if (::pread(file.get(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(size)) {
            std::memcpy(&header, bytes.data(), sizeof(header));
            const std::span<const std::byte> content = std::span<const std::byte>(bytes).subspan(sizeof(header));
            if (header.magic == expected.magic && header.size == content.size() && header.key == key &&
                header.content == hashBytes(content.data(), content.size(), key))
                result = decodeShader(content);
        }
    }
    if (!result) {
        log(LogLevel::Info, "shader.cache_damaged",
            fmt::format("'{}' is damaged and will be made anew", path.string()));
        return {};
    }
    // The clock that file systems stamp with is too coarse to order uses by.
    std::array<timespec, 2> times = {};
    times[0].tv_nsec = UTIME_OMIT;
    ::clock_gettime(CLOCK_REALTIME, &times[1]);
    ::futimens(file.get(), times.data());
    result->from_cache = true;
    return result;
}

void storeInCache(const Hash& key, const CompiledShader& shader) {
    const std::shared_ptr<const CacheFolder> folder = cacheFolder();
    if (folder->path.empty()) return;
    const auto complain = [&](const std::string& reason) {
        std::call_once(folder->complained, [&] {
            log(LogLevel::Warning, "shader.cache_unusable",
                fmt::format("shaders are not cached in '{}': {}", folder->path.string(), reason));
        });
    };

    const std::vector<std::byte> content = encodeShader(shader);
    EntryHeader header;
    header.size = content.size();
    header.key = key;
    header.content = hashBytes(content.data(), content.size(), key);
    const std::span<const std::byte, sizeof(header)> front = std::as_bytes(std::span<const EntryHeader, 1>(&header, 1));
    std::vector<std::byte> bytes(front.begin(), front.end());
    bytes.insert(bytes.end(), content.begin(), content.end());
    if (bytes.size() > folder->limit) return;

    std::error_code failure;
    std::filesystem::create_directories(folder->path, failure);
    if (failure) return complain(failure.message());
    Ledger ledger(*folder);
    if (!ledger) {
        if (::access(folder->path.c_str(), W_OK) != 0) complain(std::strerror(errno));
        return;
    }
    const std::filesystem::path path = entryPath(*folder, key);
    // A quarter more than needed, so that not every store has to look at the whole folder.
    if (ledger.total() + bytes.size() > folder->limit)
        ledger.evict(std::min(folder->limit - folder->limit / 4, folder->limit - bytes.size()));
    const FileStamp former = stampFile(path);
    if (!ledger.setTotal(ledger.total() + bytes.size())) return complain(std::strerror(errno));
    if (Status status = writeFile(path, bytes); !status) return complain(status.error().message());
    if (former.time >= 0) ledger.setTotal(ledger.total() - std::min(ledger.total(), former.size));
    // Of the same clock as a use.
    std::array<timespec, 2> times = {};
    ::clock_gettime(CLOCK_REALTIME, &times[0]);
    times[1] = times[0];
    ::utimensat(AT_FDCWD, path.c_str(), times.data(), 0);
}

}  // namespace shader

}  // namespace glint
