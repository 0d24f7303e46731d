// SPDX-License-Identifier: Apache-2.0
// Tests maps of rays with known hits.
#include "core/rays/ray_maps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <peeler/bundle.h>
#include "support/numbers.h"
#include "support/ray_hits.h"

namespace peeler::test {
namespace {

/// Pairs of t and body.
using Hits = std::vector<std::pair<float, int>>;

class Maps {
  public:
    explicit Maps(Scene scene, RayMapSettings settings)
        : scene_(std::move(scene)),
          shown_(scene_, 0),
          solids_(shown_),
          maps_(shown_, &solids_, std::move(settings)) {}

    std::vector<float> operator()(const Hits& hits) {
        std::vector<float> t;
        std::vector<std::uint32_t> keys;
        for (const auto& [at, body] : hits) {
            t.push_back(at);
            keys.push_back(keyOf(body));
        }
        std::vector<float> values(maps_.channels().size());
        maps_.evaluate(t, keys, scratch_, values);
        return values;
    }
    const RayMaps& maps() const { return maps_; }

  private:
    Scene scene_;
    PosedScene shown_;
    Solids solids_;
    RayMaps maps_;
    RayMapScratch scratch_;
};

using Values = std::vector<float>;

TEST(RayMaps, FirstLastAndCountNeedNoSolids) {
    const Scene scene = bodies(1);
    const RayMaps maps(PosedScene(scene, 0), nullptr,
                       {{RayMap::kFirst, RayMap::kLast, RayMap::kFirst, RayMap::kCount}});
    ASSERT_EQ(maps.channels().size(), 3U);
    RayMapScratch scratch;
    Values values(3);
    const float t[] = {1, 2, 5};
    const std::uint32_t keys[] = {1, 1, 1};
    maps.evaluate(t, keys, scratch, values);
    EXPECT_EQ(values, (Values{1, 5, 3}));
    maps.evaluate({}, {}, scratch, values);
    EXPECT_EQ(values, (Values{kFloatInfinity, kFloatInfinity, 0}));
}

struct KnownRay {
    const char* name;
    Hits hits;
    float thickness;
    Values paths;  ///< path lengths in the three bodies
    float parity;
};

TEST(RayMaps, InsideIsByParityAndTheInnermostCounts) {
    const KnownRay rows[] = {
        {"nothing", {}, 0, {0, 0, 0}, 0},
        {"one", {{1, 0}, {4, 0}}, 3, {3, 0, 0}, 0},
        {"out and in again", {{1, 0}, {2, 0}, {5, 0}, {9, 0}}, 5, {5, 0, 0}, 0},
        {"one after the other", {{1, 0}, {2, 0}, {3, 1}, {5, 1}}, 3, {1, 2, 0}, 0},
        {"nested", {{0, 0}, {2, 1}, {3, 2}, {4, 2}, {7, 1}, {10, 0}}, 10, {5, 4, 1}, 0},
        {"interpenetrating", {{0, 0}, {2, 1}, {5, 0}, {8, 1}}, 8, {2, 6, 0}, 0},
        {"the outer ends first, twice",
         {{0, 0}, {1, 1}, {2, 2}, {3, 0}, {4, 1}, {6, 2}},
         6,
         {1, 1, 4},
         0},
        {"touching", {{0, 0}, {2, 1}, {2, 0}, {5, 1}}, 5, {2, 3, 0}, 0},
        {"the same twice: the later one", {{1, 0}, {1, 1}, {3, 0}, {3, 1}}, 2, {0, 2, 0}, 0},
        // If a ray enters two bodies at the same point, the body with the shorter path counts as
        // inside the other, for either draw order.
        {"entered together, a", {{1, 0}, {1, 1}, {2, 1}, {5, 0}}, 4, {3, 1, 0}, 0},
        {"entered together, b", {{1, 1}, {1, 0}, {2, 1}, {5, 0}}, 4, {3, 1, 0}, 0},
        {"left together", {{1, 0}, {3, 1}, {5, 1}, {5, 0}}, 4, {2, 2, 0}, 0},
        {"a grazed edge", {{2, 0}, {2, 0}}, 0, {0, 0, 0}, 0},
        {"a grazed edge inside", {{0, 1}, {2, 0}, {2, 0}, {4, 1}}, 4, {0, 4, 0}, 0},
        {"an odd hit opens nothing", {{1, 0}}, 0, {0, 0, 0}, 1},
        {"an odd one last", {{1, 0}, {2, 0}, {3, 0}}, 1, {1, 0, 0}, 1},
        {"an odd one in another", {{1, 0}, {2, 1}, {4, 0}}, 3, {3, 0, 0}, 1},
        {"two odd ones", {{1, 0}, {2, 1}}, 0, {0, 0, 0}, 2},
    };
    Maps maps(bodies(3), {{RayMap::kThickness, RayMap::kPathLength, RayMap::kParity}});
    ASSERT_EQ(maps.maps().channels().size(), 5U);
    for (const KnownRay& row : rows) {
        Values expected{row.thickness};
        expected.insert(expected.end(), row.paths.begin(), row.paths.end());
        expected.push_back(row.parity);
        EXPECT_EQ(maps(row.hits), expected) << row.name;
    }
}

TEST(RayMaps, XRaysFollowBeerAndLambert) {
    RayMapSettings settings{{RayMap::kTransmission}};
    // The third material has no coefficient, so it attenuates nothing.
    settings.attenuation = {0.5, 2};
    Maps maps(bodies(3), settings);
    EXPECT_EQ(maps({})[0], 1);
    EXPECT_FLOAT_EQ(maps({{0, 0}, {2, 1}, {3, 1}, {4, 0}, {5, 2}, {9, 2}})[0],
                    static_cast<float>(std::exp(-0.5 * 3 - 2 * 1)));
}

TEST(RayMaps, AnOverlapIsInBothParts) {
    RayMapSettings settings{{RayMap::kOverlap}};
    settings.parts = {std::vector<char>{1, 0, 0, 0}, std::vector<char>{0, 1, 1, 0}};
    Maps maps(bodies(4), settings);
    EXPECT_EQ(maps({{0, 0}, {2, 1}, {5, 0}, {8, 1}})[0], 3);
    EXPECT_EQ(maps({{0, 0}, {5, 1}, {5, 0}, {8, 1}})[0], 0);  // the parts touch but do not overlap
    EXPECT_EQ(maps({{0, 1}, {2, 2}, {5, 1}, {8, 2}})[0], 0);  // both bodies belong to the same part
    EXPECT_EQ(maps({{0, 3}, {2, 0}, {5, 3}, {8, 0}})[0], 0);  // body 3 belongs to neither part
    EXPECT_EQ(maps({{0, 0}, {1, 1}, {2, 2}, {3, 1}, {4, 2}, {9, 0}})[0], 3);
    EXPECT_EQ(maps({{0, 1}, {1, 0}, {2, 0}, {4, 0}, {6, 0}, {9, 1}})[0], 3);
}

TEST(RayMaps, ChannelsHaveNamesOfTheirOwn) {
    Scene scene = bodies(5);
    const char* names[] = {"steel", "a.b\n", "steel", "", "steel_2"};
    for (std::size_t i = 0; i < 5; ++i)
        scene.materials[i].name = names[i];
    scene.materials.back().name = "on nothing";
    const Maps maps(scene, {{RayMap::kThickness, RayMap::kPathLength}});
    std::vector<std::string> found;
    for (const RayMapChannel& channel : maps.maps().channels())
        found.push_back(channel.name);
    EXPECT_EQ(found,
              (std::vector<std::string>{"thickness", "path.steel", "path.a_b_", "path.steel_2",
                                        "path.material 3", "path.steel_2_4"}));
}

/// Returns a bundle of rays along −Z over [−w, w] × [−h, h], starting at z = 3.
Bundle bundleOf(int width, int height, double w, double h) {
    Bundle bundle;
    bundle.name = "b";
    bundle.view.width = width;
    bundle.view.height = height;
    bundle.view.crop = {0, 0, width, height};
    bundle.view.projection = {false, w, h, 0, 6};
    bundle.view.camera_to_world[3] = {0, 0, 3, 1};
    return bundle;
}

TEST(RayMaps, NestedSpheresOfTwoMaterials) {
    const Scene scene = bodies(2);
    const PosedScene shown(scene, 0);
    const Solids solids(shown);
    const RayMaps maps(shown, &solids, {{RayMap::kThickness, RayMap::kPathLength}});
    const Bundle bundle = bundleOf(256, 256, 1, 1);
    const LayeredImage hits = sphereHits(bundle, {{{}, 1}, {{}, 0.5}});
    std::vector<float> planes;
    double volume[3] = {};
    for (int y = 0; y < 256; y += 100) {
        const int y1 = std::min(y + 100, 256);
        maps.evaluateRows(bundle, hits, y, y1, planes);
        const auto plane = static_cast<std::size_t>(y1 - y) * 256;
        ASSERT_EQ(planes.size(), 3 * plane);
        for (std::size_t i = 0; i < plane; ++i) {
            const double px = (double(i % 256) + 0.5) / 128 - 1;
            const std::size_t row = i / 256;
            const double py = (y + double(row) + 0.5) / 128 - 1;
            const double square = px * px + py * py;
            const double outer = 2 * std::sqrt(std::max(0.0, 1 - square));
            const double inner = 2 * std::sqrt(std::max(0.0, 0.25 - square));
            ASSERT_NEAR(planes[i], outer, 2e-6);
            ASSERT_NEAR(planes[plane + i], outer - inner, 2e-6);
            ASSERT_NEAR(planes[2 * plane + i], inner, 2e-6);
            for (std::size_t c = 0; c < 3; ++c)
                volume[c] += planes[c * plane + i] / (128.0 * 128);
        }
    }
    const double ball = 4 * std::numbers::pi / 3;
    EXPECT_NEAR(volume[0] / ball, 1, 1e-3);
    EXPECT_NEAR(volume[1] / (ball * 7 / 8), 1, 1e-3);
    EXPECT_NEAR(volume[2] / (ball / 8), 1, 1e-3);
}

TEST(RayMaps, LengthsAreAlongTheRaysOfAPinhole) {
    const Scene scene = bodies(1);
    const PosedScene shown(scene, 0);
    const Solids solids(shown);
    const RayMaps maps(shown, &solids, {{RayMap::kFirst, RayMap::kThickness}});
    Bundle bundle = bundleOf(16, 8, 2, 1);
    bundle.view.projection.perspective = true;
    // Two spherical shells around the eye, so that every ray has the same hits.
    const LayeredImage hits = rayHits(bundle, [](const glm::dvec3&, const glm::dvec3&) {
        return std::vector<Hit>{{2, keyOf(0)}, {5, keyOf(0)}};
    });
    std::vector<float> planes;
    maps.evaluateRows(bundle, hits, 0, 8, planes);
    for (std::size_t i = 0; i < 128; ++i) {
        EXPECT_NEAR(planes[i], 2, 1e-6);
        EXPECT_NEAR(planes[128 + i], 3, 1e-6);
    }
}

TEST(CommonDisplay, TheRaysStayWhereTheyAre) {
    const Bundle bundles[] = {bundleOf(7, 4, 0.7, 0.4), bundleOf(4, 9, 2, 4.5)};
    const std::vector<View> views = withCommonDisplay(bundles);
    for (std::size_t i = 0; i < 2; ++i) {
        const View &before = bundles[i].view, &after = views[i];
        EXPECT_EQ(after.width, 7);
        EXPECT_EQ(after.height, 9);
        EXPECT_EQ(after.crop.width(), before.crop.width());
        EXPECT_EQ(after.crop.height(), before.crop.height());
        for (const auto& [x, y] : {std::pair{0, 0}, {2, 3}}) {
            const glm::dvec3 p = worldPosition(before, x + 0.5, y + 0.5, 2);
            const glm::dvec3 q =
                worldPosition(after, after.crop.x0 + x + 0.5, after.crop.y0 + y + 0.5, 2);
            EXPECT_LT(glm::distance(p, q), 1e-12) << i;
        }
    }
}

}  // namespace
}  // namespace peeler::test
