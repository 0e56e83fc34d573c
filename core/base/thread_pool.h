#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace glint {

/// A fixed number of threads that run tasks in the order in which they came. Tasks must not throw; they may submit
/// further ones. Every task that was submitted runs, at the latest before the destructor returns.
class ThreadPool {
public:
    /// `threads` workers, 0 for one per core.
    explicit ThreadPool(uint32_t threads = 0);
    /// Runs what is queued, then ends the workers. Not to be called from a task of the pool.
    ~ThreadPool();

    /// The pool that background creation runs on: one worker per core, made at the first call. Its tasks end before the
    /// static objects that were made before that call are destroyed.
    static ThreadPool& shared();

    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    /// From any thread.
    void submit(std::function<void()> task);

    /// Returns once no task is queued or running. From any thread but the workers.
    void wait();

    uint32_t size() const { return static_cast<uint32_t>(workers_.size()); }

private:
    void work();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable idle_;
    std::deque<std::function<void()>> tasks_;
    size_t running_ = 0;
    bool ending_ = false;
    std::vector<std::thread> workers_;
};

}  // namespace glint
