// SPDX-License-Identifier: Apache-2.0
// Every fuzz target takes its seeds, and what fuzzing has found before: as a plain test, without
// libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "fuzz/fuzz_target.h"
#include "fuzz/seeds.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

class Fuzz : public testing::TestWithParam<fuzz::Target> {
  protected:
    static void take(const fuzz::SeedBytes& bytes) {
        EXPECT_NO_THROW(fuzz::attempt([&] { GetParam().take(bytes); }));
    }
};

TEST_P(Fuzz, TakesItsSeeds) {
    static const fuzz::Seeds seeds = fuzz::allSeeds();
    ASSERT_TRUE(seeds.contains(GetParam().name)) << "it has no seeds";
    const auto& inputs = seeds.at(GetParam().name);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        SCOPED_TRACE("seed " + std::to_string(i));
        take(inputs[i]);
    }
}

TEST_P(Fuzz, TakesWhatItOnceFound) {
    const fs::path folder = test::sourceDir() / "tests/fuzz/corpus" / GetParam().name;
    if (!fs::exists(folder)) return;  // nothing has been found
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        SCOPED_TRACE(entry.path().string());
        const std::string bytes = test::bytesOf(entry.path());
        EXPECT_FALSE(bytes.empty());
        take(fuzz::seedOf(bytes));
    }
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, testing::ValuesIn(fuzz::targets()),
                         [](const auto& row) { return std::string(row.param.name); });

}  // namespace
}  // namespace peeler
