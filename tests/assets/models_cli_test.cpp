// SPDX-License-Identifier: Apache-2.0
// The command on every static real model: complete on both backends, and the same bytes from both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "assets/model_files.h"
#include "assets/models.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

TEST(Models, RenderCompletelyAndAlikeOnBothBackends) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    auto models = staticModels(assets);
    ASSERT_GT(models.size(), 40U);
    std::ranges::copy(modelFiles(sourceDir() / "examples" / "scenes"), std::back_inserter(models));
    for (const auto& model : models) {
        SCOPED_TRACE(model.string());
        std::string bytes[2];
        const char* const backends[] = {"egl", "osmesa"};
        for (int i = 0; i < 2; ++i) {
            const fs::path out = scratch / (std::string(backends[i]) + ".exr");
            const auto run = runPeeler({"render", model, "-o", out, "--size", "320x240",
                                        "--backend", backends[i], "--json", "--quiet"});
            ASSERT_EQ(run.exit_code, 0) << run.err;
            const auto json = nlohmann::json::parse(run.out);
            EXPECT_EQ(json.at("complete"), true);
            EXPECT_EQ(json.at("fragmentsCounted"), json.at("fragmentsStored"));
            EXPECT_GT(json.at("layers"), 0);
            bytes[i] = bytesOf(out);
        }
        EXPECT_FALSE(bytes[0].empty());
        // Both are llvmpipe where there is no GPU, so even the recorded renderer is the same.
        EXPECT_TRUE(bytes[0] == bytes[1]) << "the files of the two backends differ";
    }
    std::printf("%zu models on 2 backends\n", models.size());
}

}  // namespace
}  // namespace peeler::test
