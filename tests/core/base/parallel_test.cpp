// SPDX-License-Identifier: Apache-2.0
#include "core/base/parallel.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace peeler {
namespace {

class Parallel : public testing::TestWithParam<int> {
  protected:
    void SetUp() override { setThreadCount(GetParam()); }
    void TearDown() override { setThreadCount(0); }
};

TEST_P(Parallel, EveryItemOnce) {
    for (const std::size_t items : {0U, 1U, 2U, 7U, 1000U}) {
        std::vector<std::atomic<int>> calls(items);
        parallelFor(items, [&](std::size_t i) { ++calls[i]; });
        for (std::size_t i = 0; i < items; ++i)
            ASSERT_EQ(calls[i], 1) << i << " of " << items;
    }
}

TEST_P(Parallel, ManyShortLoops) {
    std::atomic<std::size_t> sum{0};
    for (int loop = 0; loop < 3000; ++loop)
        parallelFor(5, [&](std::size_t i) { sum += i; });
    EXPECT_EQ(sum, 30000U);
}

TEST_P(Parallel, ThrowsWhatABodyThrowsAndWorksAfterwards) {
    for (int loop = 0; loop < 50; ++loop) {
        try {
            parallelFor(100, [&](std::size_t i) {
                if (i % 10 == 3) throw std::runtime_error("item");
            });
            FAIL() << "nothing was thrown";
        } catch (const std::runtime_error& e) {
            EXPECT_STREQ(e.what(), "item");
        }
    }
    std::atomic<int> calls{0};
    parallelFor(10, [&](std::size_t) { ++calls; });
    EXPECT_EQ(calls, 10);
}

TEST_P(Parallel, NestedLoopsRunOnTheirCaller) {
    std::atomic<int> calls{0};
    parallelFor(8, [&](std::size_t) {
        const auto here = std::this_thread::get_id();
        parallelFor(8, [&](std::size_t) {
            if (std::this_thread::get_id() == here) ++calls;
        });
    });
    EXPECT_EQ(calls, 64);
}

TEST_P(Parallel, LoopsOfSeveralThreadsDoNotMix) {
    std::vector<std::thread> threads;
    std::atomic<int> calls{0};
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&] {
            for (int loop = 0; loop < 100; ++loop)
                parallelFor(10, [&](std::size_t) { ++calls; });
        });
    }
    for (auto& thread : threads)
        thread.join();
    EXPECT_EQ(calls, 4000);
}

INSTANTIATE_TEST_SUITE_P(Threads, Parallel, testing::Values(1, 2, 5));

TEST(ParallelThreads, ALoopThatComesSecondGetsThreads) {
    setThreadCount(3);
    std::atomic<bool> begun{false}, ends{false};
    // The first loop keeps its three threads busy until the second loop has ended.
    std::thread other([&] {
        parallelFor(1000, [&](std::size_t) {
            begun = true;
            for (int i = 0; !ends && i < 1000; ++i)
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
    });
    while (!begun)
        std::this_thread::yield();
    std::atomic<int> there{0};
    // Each body waits for the other, so the check fails with a single thread.
    parallelFor(2, [&](std::size_t) {
        ++there;
        for (int i = 0; there < 2 && i < 30000; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_EQ(there, 2);
    });
    ends = true;
    other.join();
    setThreadCount(0);
}

/// Checks that a newly forked child runs loops on several threads, and ends.
void expectLoopsInAChild() {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        alarm(60);  // ends the child if it hangs
        std::atomic<int> there{0};
        // Each body waits for the other, so a single thread would hang.
        parallelFor(2, [&](std::size_t) {
            for (++there; there < 2;)
                std::this_thread::yield();
        });
        _exit(there == 2 ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
}

TEST(ParallelThreads, AChildOfForkHasItsOwn) {
    setThreadCount(2);
    parallelFor(10, [](std::size_t) {});
    expectLoopsInAChild();
    std::atomic<int> calls{0};
    parallelFor(10, [&](std::size_t) { ++calls; });
    EXPECT_EQ(calls, 10) << "and the parent keeps its threads";
    setThreadCount(0);
}

TEST(ParallelThreads, AChildThatIsForkedDuringALoopHasItsOwn) {
    setThreadCount(2);
    std::atomic<bool> begun{false}, ends{false};
    std::thread other([&] {
        parallelFor(2, [&](std::size_t) {
            for (begun = true; !ends;)
                std::this_thread::yield();
        });
    });
    while (!begun)
        std::this_thread::yield();
    expectLoopsInAChild();
    ends = true;
    other.join();
    setThreadCount(0);
}

TEST(ParallelThreads, CountIsWhatWasAskedForOrAtLeastOne) {
    setThreadCount(3);
    EXPECT_EQ(threadCount(), 3);
    setThreadCount(0);
    EXPECT_GE(threadCount(), 1);
}

}  // namespace
}  // namespace peeler
