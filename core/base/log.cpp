#include <glint/base/log.h>

#include <cstdio>
#include <mutex>

namespace glint {

namespace {

struct Receiver {
    std::mutex mutex;
    LogCallback callback;
};

Receiver& receiver() {
    // Never destroyed: threads may log while the program exits.
    static Receiver& instance = *new Receiver;
    return instance;
}

}  // namespace

void setLogCallback(LogCallback callback) {
    std::lock_guard lock(receiver().mutex);
    receiver().callback = std::move(callback);
}

void log(LogLevel level, std::string_view id, std::string_view text) {
    LogCallback callback;
    {
        std::lock_guard lock(receiver().mutex);
        callback = receiver().callback;
    }
    // Called outside the lock, so that a receiver may log or be replaced by what it calls.
    if (callback) return callback(level, id, text);
    if (level < LogLevel::Warning) return;
    std::fprintf(stderr, "%.*s [%.*s]\n", static_cast<int>(text.size()), text.data(), static_cast<int>(id.size()),
                 id.data());
}

}  // namespace glint
