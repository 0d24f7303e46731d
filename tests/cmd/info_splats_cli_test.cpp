// SPDX-License-Identifier: Apache-2.0
// Tests that `info` tells the number, degree and extent of splats.
#include <gtest/gtest.h>

#include "formats/splats/splat_files.h"

namespace peeler::test {
namespace {

/// Returns a splat whose box to 3 sigma is (0.7, −2.6, −0.4) to (1.3, −1.4, 1.4).
Splat boxedSplat() {
    Splat splat = knownSplat();
    splat.scale = {0.3, 0.2, 0.1};
    splat.rotation = glm::normalize(glm::dvec4(0, 1, 0, 1));  // X becomes −Z, Z becomes X
    return splat;
}

TEST(Info, TellsOfSplats) {
    const ScratchDir folder;
    writeFile(folder / "a.ply", splatPly({boxedSplat()}, 2));
    const std::string path = (folder / "a.ply").string();
    const Outcome text = runPeeler({"info", path});
    EXPECT_TRUE(contains(text.out, "a.ply: 3DGS PLY scene")) << text.out;
    EXPECT_TRUE(contains(text.out, "assumed: y is up, a unit is 1 m")) << text.out;
    EXPECT_TRUE(contains(text.out, "draws: 1 splat\n")) << text.out;
    EXPECT_TRUE(contains(text.out,
                         "splats: spherical harmonics of degree 2, to 3 sigma (0.7, "
                         "-2.6, -0.4) to (1.3, -1.4, 1.4)"))
        << text.out;

    const Json json = Json::parse(runPeeler({"info", "--json", path}).out);
    EXPECT_EQ(json["splats"], 1);
    EXPECT_EQ(json["points"], 0);
    EXPECT_EQ(json["splatDegree"], 2);
    EXPECT_EQ(json["nodes"][0]["splats"], 1);
    EXPECT_EQ(json["format"], "3DGS PLY");
    for (int i = 0; i < 3; ++i) {
        const auto place = static_cast<std::size_t>(i);
        EXPECT_NEAR(json["splatBounds"]["min"][place].get<double>(), glm::dvec3(0.7, -2.6, -0.4)[i],
                    1e-6);
        EXPECT_NEAR(json["splatBounds"]["max"][place].get<double>(), glm::dvec3(1.3, -1.4, 1.4)[i],
                    1e-6);
    }
}

TEST(Info, HasNoDegreeWithoutSplats) {
    const ScratchDir folder;
    const Json json =
        Json::parse(runPeeler({"info", "--json", triangle().write(folder, "a.glb").string()}).out);
    EXPECT_EQ(json["splats"], 0);
    EXPECT_TRUE(json["splatDegree"].is_null());
    EXPECT_TRUE(json["splatBounds"].is_null());
}

}  // namespace
}  // namespace peeler::test
