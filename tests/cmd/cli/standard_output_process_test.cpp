// SPDX-License-Identifier: Apache-2.0
// Tests pictures that are written to standard output.
#include <gtest/gtest.h>

#include <string>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(StandardOutput, TakesOnePicture) {
    const ScratchDir scratch;
    const std::string scene = writeScene(scratch.path(), stackScene(2)).string();
    const std::string file = (scratch / "a.png").string();
    ASSERT_EQ(runPeelerProcess({"render", scene, "-o", file, "--size", "32x18"}).exit_code, 0);
    const CommandResult png = runPeelerProcess({"render", scene, "-o", "-", "--size", "32x18"});
    EXPECT_EQ(png.exit_code, 0) << png.err;
    EXPECT_EQ(png.out, bytesOf(file));
    EXPECT_TRUE(contains(png.err, "2 layers")) << png.err;
    const CommandResult exr =
        runPeelerProcess({"render", scene, "-o", "-.exr", "--size", "32x18"}, {}, scratch.path());
    EXPECT_EQ(exr.exit_code, 0) << exr.err;
    EXPECT_EQ(exr.out.substr(0, 4), "\x76\x2f\x31\x01");
    EXPECT_FALSE(std::filesystem::exists(scratch / "-.exr"));
}

TEST(StandardOutput, TakesNothingBesides) {
    const ScratchDir scratch;
    const std::string scene = writeScene(scratch.path(), stackScene(2)).string();
    const CommandResult json = runPeelerProcess({"render", scene, "-o", "-", "--json"});
    EXPECT_EQ(json.exit_code, 2);
    EXPECT_EQ(json.out, "");
    EXPECT_TRUE(contains(json.err, "--report")) << json.err;
    const CommandResult set =
        runPeelerProcess({"render", scene, "-o", "-.exr", "--layout", "per-file"});
    EXPECT_EQ(set.exit_code, 2) << set.err;
    EXPECT_EQ(set.out, "");
}

}  // namespace
}  // namespace peeler::test
