#include <glint/base/thread_pool.h>

#include <algorithm>

namespace glint {

ThreadPool::ThreadPool(uint32_t threads) {
    if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
    workers_.reserve(threads);
    for (uint32_t i = 0; i < threads; i++) workers_.emplace_back([this] { work(); });
}

ThreadPool::~ThreadPool() {
    {
        std::lock_guard lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

ThreadPool& ThreadPool::shared() {
    static ThreadPool pool;
    return pool;
}

void ThreadPool::submit(std::function<void()> task) {
    {
        std::lock_guard lock(mutex_);
        tasks_.push_back(std::move(task));
    }
    wake_.notify_one();
}

void ThreadPool::wait() {
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [this] { return tasks_.empty() && running_ == 0; });
}

void ThreadPool::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        // A running task may still submit another: this worker, or the one that runs the task, will see it.
        wake_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
        if (tasks_.empty()) return;
        {
            std::function<void()> task = std::move(tasks_.front());
            tasks_.pop_front();
            running_++;
            lock.unlock();
            task();
            // What the task holds is released here, outside the lock and before anybody is told that it has ended.
        }
        lock.lock();
        running_--;
        if (tasks_.empty() && running_ == 0) idle_.notify_all();
    }
}

}  // namespace glint
