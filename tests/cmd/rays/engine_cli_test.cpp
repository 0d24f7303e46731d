// SPDX-License-Identifier: Apache-2.0
// Tests --engine of rays and bake: errors, and the engine that the result names.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// Instantiated for each verb with the option --engine.
class Engines : public testing::TestWithParam<const char*> {
  protected:
    Outcome run(const Words& more) const {
        const bool rays = std::string(GetParam()) == "rays";
        Words line = rays ? Words{"rays", scene_, "-o", out_ + ".npz", "--direction", "0,0,1"}
                          : Words{"bake", scene_, "-o", out_ + ".glb", "--directions", "2"};
        line.insert(line.end(), {"--resolution", "64"});
        line.insert(line.end(), more.begin(), more.end());
        return runPeeler(line);
    }
    nlohmann::ordered_json result(Words more) const {
        more.insert(more.end(), {"--json", "--quiet"});
        const Outcome done = run(more);
        EXPECT_EQ(done.exit_code, 0) << done.err;
        return nlohmann::ordered_json::parse(done.out);
    }
    Json hash(const Words& more) const { return result(more).at("settingsHash"); }

    const ScratchDir scratch_;
    const std::string scene_ = writeScene(scratch_ / ".", stackScene(3)).string();
    const std::string out_ = scratch_ / "out";
};
INSTANTIATE_TEST_SUITE_P(Verbs, Engines, testing::Values("rays", "bake"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(Engines, ThatContradictADeviceAreRefused) {
    const auto refused = [&](const Words& options, const std::string& where) {
        const Outcome done = run(options);
        EXPECT_EQ(done.exit_code, 2) << done.err;
        EXPECT_TRUE(contains(done.err, where)) << done.err;
        EXPECT_TRUE(contains(done.err, "peeler: hint: ")) << done.err;
        EXPECT_EQ(scratch_.files(), (Words{"scene.gltf", "triangle.bin"}));
    };
    refused({"--engine", "cpu", "--backend", "egl"}, "--engine cpu, --backend egl");
    refused({"--device", "uuid:GPU-AB", "--engine", "cpu"}, "--engine cpu, --device uuid:ab");
    refused({"--engine", "cpu", "--device", "0", "--require-gpu"},
            "--engine cpu, --device 0, --require-gpu");
    refused({"--engine", "gpu"}, "did you mean 'cpu'?");
    EXPECT_EQ(run({"--engine", "cpu", "--backend", "auto", "-q"}).exit_code, 0);
}

TEST_P(Engines, AreToldBeforeTheHash) {
    const auto keys = [](const nlohmann::ordered_json& json) {
        Words names;
        for (const auto& [key, value] : json.items())
            names.push_back(key);
        return names;
    };
    const auto cpu = result({"--engine", "cpu"}), gl = result({"--engine", "gl"});
    EXPECT_EQ(keys(cpu), keys(gl));
    const Words names = keys(cpu);
    ASSERT_GT(names.size(), 6U);
    EXPECT_EQ(
        Words(names.end() - 6, names.end()),
        (Words{"engine", "settingsHash", "renderer", "backend", "peakMemory", "milliseconds"}));
    EXPECT_EQ(cpu.at("engine"), "cpu");
    EXPECT_EQ(cpu.at("renderer"), "");
    EXPECT_EQ(cpu.at("backend"), "");
    EXPECT_EQ(cpu.at("milliseconds").at("context"), 0);
    EXPECT_EQ(gl.at("engine"), "gl");
    EXPECT_NE(gl.at("renderer"), "");
    EXPECT_NE(gl.at("backend"), "");
    EXPECT_GT(gl.at("milliseconds").at("context"), 0);
}

TEST_P(Engines, HaveHashesOfTheirOwn) {
    const Json cpu = hash({"--engine", "cpu"}), gl = hash({"--engine", "gl"});
    EXPECT_NE(cpu, gl);
    EXPECT_EQ(cpu, hash({"--engine", "cpu", "--threads", "1"}));
    EXPECT_EQ(gl, hash({"--backend", testBackend()})) << "who names a backend wants GL";
    for (const char* engine : {"auto", "cpu", "gl"}) {
        const auto json = result({"--engine", engine});
        EXPECT_EQ(json.at("settingsHash"), json.at("engine") == "cpu" ? cpu : gl) << engine;
        const Outcome planned = run({"--engine", engine, "--dry-run", "--quiet"});
        EXPECT_EQ(Json::parse(planned.out).at("settingsHash"), json.at("settingsHash")) << engine;
    }
}

TEST_P(Engines, OnTheCpuSayNothingOfGl) {
    const Outcome quiet = run({"--engine", "cpu"});
    ASSERT_EQ(quiet.exit_code, 0) << quiet.err;
    const auto words = {" GPU ", "OpenGL", "libEGL", "renders in software"};
    for (const char* word : words)
        EXPECT_FALSE(contains(quiet.err, word)) << quiet.err;
    const Outcome automatic = run({});
    ASSERT_EQ(automatic.exit_code, 0) << automatic.err;
    for (const char* word : words)
        EXPECT_FALSE(contains(automatic.err, word)) << automatic.err;
    const Outcome wordy = run({"--verbose"});
    const bool cpu = contains(wordy.err, "no GPU can be used, so the CPU finds the hits");
    EXPECT_NE(cpu, contains(wordy.err, "peeler: GL: ")) << wordy.err;
    EXPECT_EQ(result({}).at("engine"), cpu ? "cpu" : "gl");
}

TEST(EngineOfPictures, IsAlwaysGl) {
    const ScratchDir scratch;
    const std::string scene = writeScene(scratch / ".").string();
    const Outcome done = runPeeler({"render", scene, "-o", scratch / "a.exr", "--engine", "cpu"});
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_TRUE(contains(done.err, "unknown option: --engine")) << done.err;
}

}  // namespace
}  // namespace peeler::test
