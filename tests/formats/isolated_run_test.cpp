// SPDX-License-Identifier: Apache-2.0
// Work in a child process: its result, its errors, its end by crash, time or memory.
#include "formats/file/isolated_run.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

Error isolatedError(const std::function<Bytes()>& work, const IsolationLimits& limits = {}) {
    try {
        runIsolated(work, limits, "a hint");
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "it ended well";
    return Error(ErrorKind::kInternal, "none");
}

TEST(IsolatedRun, GivesBackWhateverComesOut) {
    EXPECT_EQ(runIsolated([] { return Bytes{}; }, {}, ""), Bytes());
    EXPECT_EQ(runIsolated([] { return Bytes{1, 0, 2}; }, {}, ""), (Bytes{1, 0, 2}));
    const auto large = [] {
        Bytes bytes(5000001);
        for (std::size_t i = 0; i < bytes.size(); ++i)
            bytes[i] = static_cast<std::uint8_t>(i * i >> 3U);
        return bytes;
    };
    EXPECT_TRUE(runIsolated(large, {}, "") == large());
}

TEST(IsolatedRun, IsAnotherProcess) {
    int here = 1;
    runIsolated(
        [&] {
            here = 2;
            return Bytes{};
        },
        {}, "");
    EXPECT_EQ(here, 1);
}

TEST(IsolatedRun, ThrowsTheErrorOfTheChild) {
    const Error error =
        isolatedError([]() -> Bytes { throw Error(ErrorKind::kMemory, "what", "where", "hint"); });
    EXPECT_EQ(error.kind(), ErrorKind::kMemory);
    EXPECT_STREQ(error.what(), "what");
    EXPECT_EQ(error.hint(), "hint");
}

TEST(IsolatedRun, SurvivesACrash) {
    const Error error = isolatedError([]() -> Bytes { std::abort(); });
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("signal 6"), std::string::npos) << error.what();
    EXPECT_EQ(error.hint(), "a hint");
    EXPECT_EQ(isolatedError([]() -> Bytes { _exit(7); }).kind(), ErrorKind::kInput);
}

TEST(IsolatedRun, EndsWhatTakesTooLong) {
    IsolationLimits limits;
    limits.cpu_seconds = 1;
    const Error error = isolatedError(
        []() -> Bytes {
            for (volatile int i = 0; i == 0;) {
            }
            return {};
        },
        limits);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("longer than 1 s"), std::string::npos) << error.what();
}

TEST(IsolatedRun, GivesNoMoreMemoryThanAllowed) {
    if (kAddressSanitizer) GTEST_SKIP() << "AddressSanitizer reserves all address space";
    IsolationLimits limits;
    limits.memory_bytes = std::uint64_t{64} << 20;
    EXPECT_EQ(runIsolated([] { return Bytes(Bytes(16U << 20U).size() >> 20U); }, limits, "").size(),
              16U);
    const Error error = isolatedError([] { return Bytes(std::size_t{256} << 20U); }, limits);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
}

TEST(IsolatedRun, RunsFromSeveralThreads) {
    std::vector<Bytes> results(40);
    parallelFor(results.size(), [&](std::size_t i) {
        results[i] =
            runIsolated([&] { return Bytes(100000 + i, static_cast<std::uint8_t>(i)); }, {}, "");
    });
    for (std::size_t i = 0; i < results.size(); ++i)
        EXPECT_EQ(results[i], Bytes(100000 + i, static_cast<std::uint8_t>(i)));
}

}  // namespace
}  // namespace peeler::test
