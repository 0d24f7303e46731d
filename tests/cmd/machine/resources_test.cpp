// SPDX-License-Identifier: Apache-2.0
// Tests what --threads means for each thread pool.
#include "cmd/machine/resources.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "core/base/parallel.h"
#include "formats/image/image_library.h"

namespace peeler::cmd {
namespace {

int openImageIo(const char* name) {
    int value = 0;
    EXPECT_TRUE(OIIO::getattribute(name, value)) << name;
    return value;
}

std::string rasterizer() {
    const char* text = std::getenv("LP_NUM_THREADS");
    return text ? text : "";
}

class Threads : public testing::Test {
  protected:
    void SetUp() override { forget(); }
    // CUE_THREADS must not remain set, because later tests start OpenImageIO's programs, which read
    // it.
    void TearDown() override { forget(); }

  private:
    static void forget() {
        for (const char* name : {"LP_NUM_THREADS", "SLURM_CPUS_PER_TASK", "CUE_THREADS"})
            unsetenv(name);
    }
};

TEST_F(Threads, AreTheSameInLoopsRasterizerAndLibraries) {
    setThreads(3);
    imageLibrary();  // sets its number of threads when it is loaded, and at every later change
    EXPECT_EQ(threadCount(), 3);
#ifndef __SANITIZE_THREAD__  // builds with ThreadSanitizer use no threads
    EXPECT_EQ(rasterizer(), "3");
    EXPECT_EQ(openImageIo("threads"), 3);
    EXPECT_EQ(openImageIo("exr_threads"), 3);
#endif
    setThreads(1);
    EXPECT_EQ(threadCount(), 1);
    EXPECT_EQ(rasterizer(), "0") << "none besides the caller";
    EXPECT_EQ(openImageIo("threads"), 1);
    EXPECT_EQ(openImageIo("exr_threads"), -1);
}

TEST_F(Threads, AreTheSchedulersUnlessTheyAreAskedFor) {
    setenv("CUE_THREADS", "1", 1);
    EXPECT_EQ(allowedThreads().amount, 1U);
    setThreads(0);
    EXPECT_EQ(threadCount(), 1);
    setThreads(5);
    EXPECT_EQ(threadCount(), 5);
    setenv("CUE_THREADS", "100000", 1);
    setThreads(0);
    EXPECT_EQ(threadCount(), static_cast<int>(allowedThreads().amount));
    EXPECT_LE(threadCount(), affinityCount());
}

TEST_F(Threads, LeaveTheUsersOwnVariableAloneUnlessTheyAreAskedFor) {
    setenv("LP_NUM_THREADS", "7", 1);
    setThreads(0);
    EXPECT_EQ(rasterizer(), "7");
    setThreads(2);
    EXPECT_NE(rasterizer(), "7");
}

}  // namespace
}  // namespace peeler::cmd
