#include <glint/tracing/detail/parallel.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>

namespace glint::detail {

namespace {

struct Loop {
    const std::function<void(size_t)>* body = nullptr;
    size_t count = 0;
    std::atomic<size_t> next = 0;
    std::mutex mutex;
    std::condition_variable done;
    size_t finished = 0;

    /// A helper that starts late finds nothing left, and does not touch the body, which may be gone by then.
    void work() {
        size_t mine = 0;
        for (size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1), mine++) (*body)(i);
        if (mine == 0) return;
        const std::lock_guard lock(mutex);
        finished += mine;
        if (finished == count) done.notify_all();
    }
};

}  // namespace

void parallelFor(ThreadPool* pool, size_t count, const std::function<void(size_t)>& body) {
    if (pool == nullptr || pool->size() < 2 || count < 2) {
        for (size_t i = 0; i < count; i++) body(i);
        return;
    }
    const auto loop = std::make_shared<Loop>();
    loop->body = &body;
    loop->count = count;
    const size_t helpers = std::min<size_t>(pool->size(), count) - 1;
    for (size_t i = 0; i < helpers; i++) pool->submit([loop] { loop->work(); });
    loop->work();
    std::unique_lock lock(loop->mutex);
    loop->done.wait(lock, [&] { return loop->finished == count; });
}

}  // namespace glint::detail
