// SPDX-License-Identifier: Apache-2.0
// Tests that the benchmark scenes have the properties that are documented.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

struct BenchmarkScenes : testing::Test {
    /// Writes the scenes of these names to the scratch folder.
    void make(const std::vector<std::string>& names) {
        std::vector<std::string> command = {python(), "-B",
                                            (sourceDir() / "tests/benchmarks/scenes.py").string(),
                                            scratch.path().string()};
        command.insert(command.end(), names.begin(), names.end());
        const Outcome made = runCommand(command);
        ASSERT_EQ(made.exit_code, 0) << made.err;
    }

    nlohmann::json said(std::vector<std::string> arguments) const {
        arguments.emplace_back("--json");
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return nlohmann::json::parse(result.out, nullptr, false);
    }

    std::uint64_t triangles(const std::string& name) const {
        return said({"info", (scratch / (name + ".glb")).string()})["triangles"];
    }

    nlohmann::json rendered(const std::string& name, const std::string& size) const {
        return said({"render", (scratch / (name + ".glb")).string(), "-o",
                     (scratch / "out.exr").string(), "--size", size});
    }

    ScratchDir scratch;
};

TEST_F(BenchmarkScenes, SpheresHaveTheTrianglesThatTheirResultsAreGivenFor) {
    make({"spheres", "fine-spheres", "small-spheres", "large-spheres"});
    EXPECT_EQ(triangles("spheres"), 30U * 6'240);
    EXPECT_EQ(triangles("fine-spheres"), 30U * 57'120);
    EXPECT_EQ(triangles("small-spheres"), 200U * 6'240);
    EXPECT_EQ(triangles("large-spheres"), 100U * 1'520);
}

TEST_F(BenchmarkScenes, SoupsHaveTheTrianglesOfTheirNames) {
    make({"soup-192k", "soup-1728k", "soup-1280k", "soup-640k", "cube-192k", "cube-160k",
          "soup-of-16", "soup-of-1024"});
    EXPECT_EQ(triangles("soup-192k"), 192'000U);
    EXPECT_EQ(triangles("soup-1728k"), 1'728'000U);
    EXPECT_EQ(triangles("soup-1280k"), 1'280'000U);
    EXPECT_EQ(triangles("soup-640k"), 640'000U);
    EXPECT_EQ(triangles("cube-192k"), 192'000U);
    EXPECT_EQ(triangles("cube-160k"), 160'000U);
    EXPECT_EQ(triangles("soup-of-16"), 16U * 1'600);
    EXPECT_EQ(triangles("soup-of-1024"), 1024U * 1'600);
}

TEST_F(BenchmarkScenes, SpheresHaveTheLayersAndFragmentsThatAreToldOfThem) {
    make({"spheres", "small-spheres", "large-spheres"});
    // At full size there are 7.1, 8.7 and 37.3 million fragments, at this size a sixteenth of these
    // numbers.
    const auto check = [&](const char* name, int layers, double fragments) {
        const auto picture = rendered(name, "480x270");
        EXPECT_NEAR(picture["layers"].get<int>(), layers, 2) << name;
        EXPECT_NEAR(picture["fragmentsStored"].get<double>(), fragments / 16, 0.02 * fragments / 16)
            << name;
    };
    check("spheres", 24, 7.1e6);
    check("small-spheres", 38, 8.7e6);
    check("large-spheres", 70, 37.3e6);
}

TEST_F(BenchmarkScenes, PanesCoverEveryPixelWithEveryLayer) {
    make({"quads-1", "quads-128"});
    EXPECT_EQ(rendered("quads-1", "64x36")["fragmentsStored"], 64 * 36);
    const auto picture = rendered("quads-128", "64x36");
    EXPECT_EQ(picture["layers"], 128);
    EXPECT_EQ(picture["fragmentsStored"], 128 * 64 * 36);
}

TEST_F(BenchmarkScenes, ForestAndCityAreLarge) {
    make({"forest", "city"});
    EXPECT_GE(triangles("forest"), 200'000U);  // two triangles per leaf
    EXPECT_GE(triangles("city"), 100'000U);
    EXPECT_GT(rendered("forest", "160x90")["layers"], 10);
    EXPECT_GT(rendered("city", "160x90")["layers"], 5);
}

}  // namespace
}  // namespace peeler::test
