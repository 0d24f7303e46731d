// SPDX-License-Identifier: Apache-2.0
// Tests the results for rays whose hits are known: parity, JSON, and the limit of voxels.
#include "cmd/rays/ray_parity.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "cmd/rays/ray_results.h"
#include "cmd/rays/rays_options.h"
#include "core/rays/voxels.h"
#include "support/ray_hits.h"

namespace peeler::cmd {
namespace {

using Json = nlohmann::ordered_json;
using test::Hit;
using test::rayHits;

class RayParityTest : public testing::Test, protected test::TracedSpheres {};

TEST_F(RayParityTest, IsReported) {
    std::ostringstream out, err;
    Console console(out, err, false);
    {
        RayParity parity(scene_, solids_, console);
        trace(parity, bundles_);
        Json result;
        parity.addTo(result);
        EXPECT_EQ(result.at("parity").at("holds"), true);
        EXPECT_EQ(result.at("parity").at("solids").size(), 2U);
        std::uint64_t rays = 0;
        for (const Bundle& bundle : bundles_)
            rays += bundle.rays();
        EXPECT_EQ(err.str(), "peeler: closed: each of " + groupedText(rays) +
                                 " rays enters as often as it leaves\n");
    }
    // Now the first body has a hole, and one ray passes through the hole.
    scene_.meshes[0].primitives[0].positions.resize(9);
    const PosedScene shown(scene_, 0);
    const Solids open(shown);
    const auto hits = rayHits(bundles_[1], [n = 0](const auto&, const auto&) mutable {
        std::vector<Hit> found = {{1, 1}, {2, 1}, {3, 4}, {4, 4}};
        if (++n == 10) found.erase(found.begin());
        return found;
    });
    RayParity parity(scene_, open, console);
    parity.begin(bundles_, {});
    parity.take(1, hits);
    parity.finish();
    EXPECT_FALSE(parity.holds());
    try {
        parity.fail();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_STREQ(e.what(),
                     "1 ray hits a solid an odd number of times: not every mesh is closed");
        EXPECT_EQ(e.where(), "body 0");
        EXPECT_NE(e.hint(), "");
    }
    EXPECT_NE(err.str().find("warning: body 0: 1 of "), std::string::npos) << err.str();
    EXPECT_NE(err.str().find("peeler: open: 1 of "), std::string::npos) << err.str();
    EXPECT_NE(err.str().find(" rays enters a surface that it does not leave, at 1 of 2 surfaces"),
              std::string::npos)
        << err.str();
    EXPECT_NE(err.str().find("3 edges are open; the first is in askew, pixel (9, 0), along (0.26"),
              std::string::npos)
        << err.str();
    Json result;
    parity.addTo(result);
    const Json& first = result.at("parity").at("solids").at(0);
    EXPECT_EQ(first.at("node"), "body 0");
    EXPECT_EQ(first.at("oddRays"), 1);
    EXPECT_EQ(first.at("openEdges"), 3);
    EXPECT_EQ(first.at("firstOddRays").at(0).at("x"), 9);
    // The reported position is the ray's last hit on the body, at Z = 2.
    const glm::dvec3 place = worldPosition(bundles_[1].view, 9 + bundles_[1].view.sample.x,
                                           bundles_[1].view.sample.y, 2);
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(first.at("firstOddRays").at(0).at("position").at(i).get<double>(),
                    place[static_cast<int>(i)], 1e-6);
    EXPECT_EQ(result.at("parity").at("solids").at(1).at("oddRays"), 0);
}

TEST_F(RayParityTest, ResultsAreTold) {
    Json json;
    addRayResults({}, json);
    EXPECT_TRUE(json.is_null());
    RayResults results;
    results.maps = {{"side", "m.exr", {{"count", 0, 6, 9, {}}, {"thickness", {}, {}, 0, 2.5}}}};
    results.voxels = {"v.npz", {3, 4, 5}, 0.5, 6, 1, 0.75};
    results.next_hits = {7, 8, 9, 1};
    addRayResults(results, json);
    EXPECT_EQ(json.dump(),
              R"({"maps":[{"bundle":"side","output":"m.exr","channels":[)"
              R"({"name":"count","least":0.0,"greatest":6.0},{"name":"thickness","volume":2.5}]}],)"
              R"("voxels":{"output":"v.npz","cells":[3,4,5],"spacing":0.5,"occupied":6,)"
              R"("disputed":1,"volume":0.75},)"
              R"("points":{"count":7,"before":8,"after":9,"besideBundles":1}})");
}

TEST_F(RayParityTest, VoxelsOverTheBudget) {
    const AxisBundles axes = axisBundles(box_, box_, {70});
    // Votes take three bits per cell, in whole words along z.
    const std::uint64_t bytes =
        24 * static_cast<std::uint64_t>(axes.cells.x * axes.cells.y * ((axes.cells.z + 63) / 64));
    EXPECT_NO_THROW(checkVoxelMemory(axes, 0));
    EXPECT_NO_THROW(checkVoxelMemory(axes, bytes));
    try {
        checkVoxelMemory(axes, bytes - 1);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kMemory);
        EXPECT_NE(e.hint().find("fewer"), std::string::npos);
    }
}

}  // namespace
}  // namespace peeler::cmd
