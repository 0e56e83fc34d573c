#include <glint/base/thread_pool.h>

#include <gtest/gtest.h>

#include <atomic>
#include <memory>

using namespace glint;

TEST(ThreadPool, RunsEverything) {
    std::atomic<int> count = 0;
    ThreadPool pool(3);
    EXPECT_EQ(pool.size(), 3u);
    for (int i = 0; i < 1000; i++) pool.submit([&] { count++; });
    pool.wait();
    EXPECT_EQ(count, 1000);
    pool.wait();
}

TEST(ThreadPool, OneWorkerKeepsTheOrder) {
    std::vector<int> order;
    ThreadPool pool(1);
    for (int i = 0; i < 100; i++) pool.submit([&order, i] { order.push_back(i); });
    pool.wait();
    ASSERT_EQ(order.size(), 100u);
    for (int i = 0; i < 100; i++) EXPECT_EQ(order[static_cast<size_t>(i)], i);
}

TEST(ThreadPool, DestructionRunsWhatIsQueued) {
    std::atomic<int> count = 0;
    {
        ThreadPool pool(2);
        for (int i = 0; i < 200; i++)
            pool.submit([&] {
                std::this_thread::yield();
                count++;
            });
    }
    EXPECT_EQ(count, 200);
}

TEST(ThreadPool, TasksMaySubmitTasks) {
    std::atomic<int> count = 0;
    std::function<void(int)> grow;
    {
        ThreadPool pool(2);
        grow = [&](int depth) {
            count++;
            if (depth == 0) return;
            for (int i = 0; i < 2; i++) pool.submit([&grow, depth] { grow(depth - 1); });
        };
        pool.submit([&] { grow(8); });
        pool.wait();
        EXPECT_EQ(count, 511);
        pool.submit([&] { grow(8); });
    }
    EXPECT_EQ(count, 1022);
}

TEST(ThreadPool, WhatATaskHoldsIsReleasedBeforeWaitReturns) {
    ThreadPool pool(2);
    const auto held = std::make_shared<int>(1);
    for (int i = 0; i < 50; i++) pool.submit([held] { std::this_thread::yield(); });
    pool.wait();
    EXPECT_EQ(held.use_count(), 1);
}

TEST(ThreadPool, ManyThreadsSubmit) {
    std::atomic<int> count = 0;
    ThreadPool pool(2);
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++)
        threads.emplace_back([&] {
            for (int k = 0; k < 100; k++) pool.submit([&] { count++; });
            pool.wait();
        });
    for (std::thread& thread : threads) thread.join();
    pool.wait();
    EXPECT_EQ(count, 400);
}

TEST(ThreadPool, EmptyPoolEnds) {
    ThreadPool pool;
    EXPECT_GE(pool.size(), 1u);
}

TEST(ThreadPool, SharedIsOne) {
    std::atomic<bool> ran = false;
    ThreadPool::shared().submit([&] { ran = true; });
    ThreadPool::shared().wait();
    EXPECT_TRUE(ran);
    EXPECT_EQ(&ThreadPool::shared(), &ThreadPool::shared());
}
