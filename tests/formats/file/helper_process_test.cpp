// SPDX-License-Identifier: Apache-2.0
// Tests work in a helper process: its result, its errors, and its end by crash, time or memory.
#include "formats/file/helper_process.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>

#include <atomic>
#include <csignal>
#include <string_view>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/file/lying_helper.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

SharedFile ask(std::string_view wish, const Bytes& bytes = {}, std::uint64_t number = 0,
               int cpu_seconds = 10) {
    SharedFile request;
    request.put(std::span<const char>(wish));
    request.put(bytes);
    request.putOne(number);
    request.seek(0);
    return runHelper({testHelper(), cpu_seconds, "a hint"}, request);
}

Error errorOfHelper(std::string_view wish, std::uint64_t number = 0, int cpu_seconds = 10) {
    try {
        ask(wish, Bytes(1000), number, cpu_seconds);
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "it ended well";
    return Error(ErrorKind::kInternal, "none");
}

TEST(HelperProcess, GivesBackWhateverComesOut) {
    EXPECT_EQ(ask("echo").take<std::uint8_t>(), Bytes());
    EXPECT_EQ(ask("echo", {1, 0, 2}).take<std::uint8_t>(), (Bytes{1, 0, 2}));
    Bytes large(5000001);
    for (std::size_t i = 0; i < large.size(); ++i)
        large[i] = static_cast<std::uint8_t>(i * i >> 3U);
    EXPECT_TRUE(ask("echo", large).take<std::uint8_t>() == large);
}

TEST(HelperProcess, ResultsAreNoLongerThanTheyAre) {
    SharedFile result = ask("echo", {1, 2, 3});
    EXPECT_THROW(result.take<std::uint16_t>(), Error) << "three bytes are no numbers of two";
    SharedFile other = ask("echo", {1, 2, 3});
    other.take<std::uint8_t>();
    EXPECT_THROW(other.takeOne<std::uint8_t>(), Error);
    SharedFile file;
    file.putOne(~std::uint64_t{0});
    file.seek(0);
    EXPECT_THROW(file.take<std::uint8_t>(), Error) << "no memory is taken for what is not there";
}

TEST(HelperProcess, ThrowsTheErrorOfTheHelper) {
    const Error error = errorOfHelper("error");
    EXPECT_EQ(error.kind(), ErrorKind::kMemory);
    EXPECT_STREQ(error.what(), "what");
    EXPECT_EQ(error.where(), "");
    EXPECT_EQ(error.hint(), "hint");
    EXPECT_EQ(errorOfHelper("throw").kind(), ErrorKind::kInput);
    EXPECT_STREQ(errorOfHelper("half an answer").what(), "and no more");
}

TEST(HelperProcess, SurvivesACrash) {
    const Error error = errorOfHelper("abort");
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("signal 6"), std::string::npos) << error.what();
    EXPECT_EQ(error.hint(), "a hint");
    for (const std::uint64_t code : {0, 7}) {
        EXPECT_EQ(errorOfHelper("exit", code).kind(), ErrorKind::kInput);
        EXPECT_STREQ(errorOfHelper("exit", code).what(), "the decoder ends without a result");
    }
}

TEST(HelperProcess, EndsWhatTakesTooLong) {
    const Error error = errorOfHelper("loop", 0, 1);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("longer than 1 s"), std::string::npos) << error.what();
}

TEST(HelperProcess, TellsTheTimeThatItTook) {
    SharedFile request;
    request.put(std::span<const char>(std::string_view("loop")));
    request.put(Bytes());
    request.putOne(std::uint64_t{0});
    request.seek(0);
    std::atomic<std::uint64_t> used = 0;
    EXPECT_THROW(runHelper({testHelper(), 1, "", &used}, request), Error);
    EXPECT_NEAR(static_cast<double>(used), 1e6, 2e5);
}

TEST(HelperProcess, GivesNoMoreMemoryThanAllowed) {
    if (kShadowMemory) GTEST_SKIP() << "sanitizers reserve all address space";
    constexpr std::uint64_t kFits = 16U << 20U, kDoesNot = 256U << 20U;
    EXPECT_EQ(ask("memory", {}, kFits).takeOne<std::uint64_t>(), kFits);
    EXPECT_EQ(errorOfHelper("memory", kDoesNot).kind(), ErrorKind::kInput);
    EXPECT_EQ(errorOfHelper("unlimited memory", 2 * kDoesNot).kind(), ErrorKind::kInput)
        << "nor before it is told what is promised";
}

TEST(HelperProcess, InheritsNothing) {
    const SharedFile open_meanwhile;
    sigset_t set, before;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &set, &before);
    const auto action = std::signal(SIGPIPE, SIG_IGN);
    SharedFile result = ask("inheritance");
    std::signal(SIGPIPE, action);
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    EXPECT_EQ(result.takeOne<std::uint64_t>(), 3U) << "request, result and /dev/null";
    EXPECT_EQ(result.takeOne<std::uint64_t>(), 0U) << "it could open more";
    EXPECT_EQ(result.takeOne<std::uint64_t>(), 0U) << "PATH";
    EXPECT_EQ(result.takeOne<std::uint64_t>(), 0U) << "a blocked signal";
    EXPECT_EQ(result.takeOne<std::uint64_t>(), 0U) << "an ignored signal";
}

/// Whether this kernel filters system calls, and this build has a filter for this architecture.
bool filtersCalls() {
#if defined(__x86_64__) || defined(__aarch64__)
    return !kShadowMemory && prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0;
#else
    return false;
#endif
}

TEST(HelperProcess, EndsWhatAsksForWhatNoDecoderNeeds) {
    if (!filtersCalls()) GTEST_SKIP() << "there is no filter of system calls here";
    constexpr std::uint64_t kKinds = 10;
    for (std::uint64_t kind = 0; kind < kKinds; ++kind) {
        const Error error = errorOfHelper("transgression", kind);
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(error.what()).find("a system call"), std::string::npos)
            << kind << ": " << error.what();
    }
    EXPECT_STREQ(errorOfHelper("transgression", kKinds).what(),
                 "the decoder ends without a result");
}

TEST(HelperProcess, BelievesNoLieAboutAnError) {
    constexpr std::uint64_t kHuge = std::uint64_t{1} << 62;
    const Bytes word(4, 'a');
    const auto failed = [](int kind) { return Answer().add(HelperState::kFailed).add(kind); };
    const auto input = [&] { return failed(static_cast<int>(ErrorKind::kInput)); };
    const std::pair<const char*, Answer> lies[] = {
        {"nothing", Answer()},
        {"a state that there is not", Answer().add(std::uint32_t{77}).addArray(4, word)},
        {"no kind", Answer().add(HelperState::kFailed)},
        {"the exit code of what is done", failed(0).addArray(4, word).addArray(4, word)},
        {"a kind that there is not", failed(77).addArray(4, word).addArray(4, word)},
        {"a negative kind", failed(-1).addArray(4, word).addArray(4, word)},
        {"a bug of ours", failed(1).addArray(4, word).addArray(4, word)},
        {"a wrong use", failed(2).addArray(4, word).addArray(4, word)},
        {"a lost device", failed(5).addArray(4, word).addArray(4, word)},
        {"a text that is cut off", input().addArray(5, word)},
        {"a text without end", input().addArray(kHuge, word)},
        {"a text of all there can be", input().addArray(~std::uint64_t{0}, word)},
        {"a text that is a flood", input().addArray(9000, Bytes(9000, 'a')).addArray(4, word)},
        {"a hint that is a flood", input().addArray(4, word).addArray(9000, Bytes(9000, 'a'))},
    };
    for (const auto& [name, lie] : lies) {
        try {
            lie.run();
            ADD_FAILURE() << name << " is believed";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << name;
            EXPECT_NE(std::string(error.what()).find("decoder"), std::string::npos)
                << name << ": " << error.what();
        }
    }
    try {
        input().addArray(4, word).addArray(4, word).run();
        ADD_FAILURE() << "an error is none";
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "aaaa") << "what is no lie";
    }
}

/// If SIGCHLD is ignored, there is no exit status, so success must be visible in the result itself.
TEST(HelperProcess, WorksWhereChildrenAreIgnored) {
    const auto action = std::signal(SIGCHLD, SIG_IGN);
    EXPECT_EQ(ask("echo", {1, 2}).take<std::uint8_t>(), (Bytes{1, 2}));
    EXPECT_EQ(errorOfHelper("abort").kind(), ErrorKind::kInput);
    std::signal(SIGCHLD, action);
}

TEST(HelperProcess, ThatCannotBeStartedIsAFaultOfTheInstallation) {
    SharedFile request;
    try {
        runHelper({"/nowhere/peeler_decode"}, request);
        ADD_FAILURE() << "it was started";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInternal);
        EXPECT_EQ(error.where(), "/nowhere/peeler_decode");
    }
}

TEST(HelperProcess, RunsFromSeveralThreads) {
    std::vector<Bytes> results(40);
    const auto expected = [](std::size_t i) {
        return Bytes(100000 + i, static_cast<std::uint8_t>(i));
    };
    parallelFor(results.size(),
                [&](std::size_t i) { results[i] = ask("echo", expected(i)).take<std::uint8_t>(); });
    for (std::size_t i = 0; i < results.size(); ++i)
        EXPECT_EQ(results[i], expected(i));
}

}  // namespace
}  // namespace peeler::test
