// SPDX-License-Identifier: Apache-2.0
// In the short run the backends share what takes seconds, so that each of it is done by one of
// them; with everything asked for, each does all. That both make the same bits,
// core/agreement_gl_test.cpp and assets/models_cli_test.cpp ask.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>

#include "support/test_support.h"

namespace peeler::test {

/// Is the i-th of many this backend's?
inline bool isMine(std::size_t i) {
    return exhaustive() || (i % 2 == 0) == (testBackend() == "egl");
}

/// To be called in SetUp() by suites of which the tests take turns.
inline void skipUnlessMine() {
    const testing::UnitTest& all = *testing::UnitTest::GetInstance();
    const testing::TestSuite& suite = *all.current_test_suite();
    for (int i = 0; i < suite.total_test_count(); ++i)
        if (suite.GetTestInfo(i) == all.current_test_info() && !isMine(static_cast<std::size_t>(i)))
            GTEST_SKIP() << "the other backend has it, but with PEELER_TEST_ALL";
}

class TakingTurns : public testing::Test {
  protected:
    void SetUp() override { skipUnlessMine(); }
};

}  // namespace peeler::test
