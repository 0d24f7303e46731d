// SPDX-License-Identifier: Apache-2.0
// Tests real models with closed surfaces: every ray must leave each solid that it enters.
#include <gtest/gtest.h>

#include "formats/gltf/gltf_reader.h"
#include "support/odd_rays.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(ClosedModels, EveryRayLeavesWhatItEnters) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const char* model : {"Duck/glTF-Binary/Duck.glb", "CesiumMan/glTF-Binary/CesiumMan.glb"}) {
        const std::filesystem::path file = assets / "gltf-sample-assets" / model;
        const OddRays found =
            countOddRays(file.stem(), readGltf(file), 64, 256, testBackend() == "egl");
        EXPECT_GT(found.hits, found.rays / 2);
        EXPECT_EQ(found.raw, 0U);
        EXPECT_EQ(found.refined, 0U);
        EXPECT_EQ(found.cpu, 0U);
    }
}

}  // namespace
}  // namespace peeler::test
