// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_builder.h"

namespace peeler::test {
namespace {

/// Returns a triangle, and a node with the first of these lights.
GltfBuilder lit(const Json& lights) {
    GltfBuilder builder = triangle();
    builder.gltf["extensions"]["KHR_lights_punctual"]["lights"] = lights;
    builder.gltf["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    builder.gltf["scenes"][0]["nodes"].push_back(1);
    return builder;
}

TEST(GltfLights, AreReadWithTheirDefaults) {
    const Json lights = Json::parse(R"([
        {"type": "spot", "name": "stage", "color": [1, 0.5, 0.25], "intensity": 40, "range": 9,
         "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.3}},
        {"type": "directional", "range": 4}, {"type": "point"}, {"type": "spot", "spot": {}}])");
    const Scene scene = load(lit(lights));
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.lights.size(), 4U);
    const Light& stage = scene.lights[0];
    EXPECT_EQ(stage.name, "stage");
    EXPECT_EQ(stage.type, LightType::kSpot);
    EXPECT_EQ(stage.color, glm::dvec3(1, 0.5, 0.25));
    EXPECT_EQ(stage.intensity, 40);
    EXPECT_EQ(stage.range, 9);
    EXPECT_EQ(stage.inner_cone, 0.1);
    EXPECT_EQ(stage.outer_cone, 0.3);
    EXPECT_EQ(scene.lights[1].type, LightType::kDirectional);
    EXPECT_FALSE(scene.lights[1].range) << "a directional light has none";
    EXPECT_EQ(scene.lights[2].type, LightType::kPoint);
    EXPECT_EQ(scene.lights[2].color, glm::dvec3(1));
    EXPECT_EQ(scene.lights[2].intensity, 1);
    EXPECT_EQ(scene.lights[3].inner_cone, 0);
    EXPECT_NEAR(scene.lights[3].outer_cone, 0.7853981633974483, 1e-15);
    EXPECT_EQ(scene.nodes[0].light, -1);
    EXPECT_EQ(scene.nodes[1].light, 0);
    EXPECT_EQ(PosedScene(scene, 0).lights().size(), 1U);
}

TEST(GltfLights, OfUnknownTypeAreOff) {
    const Scene scene = load(lit(Json::parse(R"([{"type": "area"}, {"type": "point"}])")));
    EXPECT_TRUE(warned(scene, "/extensions/KHR_lights_punctual/lights/0"));
    EXPECT_EQ(scene.lights.size(), 1U);
    EXPECT_EQ(scene.nodes[1].light, -1);
}

TEST(GltfLights, AreRefusedWhereTheyBreakTheSpecification) {
    const std::pair<const char*, const char*> refused[] = {
        {R"({})", ""},
        {R"({"type": 3})", "/type"},
        {R"({"type": "point", "color": [1, 1]})", "/color"},
        {R"({"type": "point", "color": [1, -1, 1]})", "/color/1"},
        {R"({"type": "point", "intensity": "bright"})", "/intensity"},
        {R"({"type": "point", "intensity": -1})", "/intensity"},
        {R"({"type": "point", "range": 0})", "/range"},
        {R"({"type": "spot"})", ""},
        {R"({"type": "spot", "spot": 45})", "/spot"},
        {R"({"type": "spot", "spot": {"innerConeAngle": true}})", "/spot/innerConeAngle"},
        {R"({"type": "spot", "spot": {"innerConeAngle": -0.1}})", "/spot/innerConeAngle"},
        {R"({"type": "spot", "spot": {"innerConeAngle": 1}})", "/spot/innerConeAngle"},
        {R"({"type": "spot", "spot": {"outerConeAngle": 1.6}})", "/spot/outerConeAngle"}};
    for (const auto& [light, where] : refused) {
        const Error error = errorOf(lit(Json::array({Json::parse(light)})));
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << light;
        EXPECT_EQ(error.where(), std::string("/extensions/KHR_lights_punctual/lights/0") + where);
    }
}

TEST(GltfLights, AreNamedByAnIndexThatIsThere) {
    for (const char* index : {"1", "-1", "0.5", "\"0\""}) {
        GltfBuilder builder = lit(Json::parse(R"([{"type": "point"}])"));
        builder.gltf["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = Json::parse(index);
        EXPECT_EQ(errorOf(builder).where(), "/nodes/1/extensions/KHR_lights_punctual/light");
    }
    GltfBuilder none = lit(Json::array());
    EXPECT_EQ(errorOf(none).where(), "/nodes/1/extensions/KHR_lights_punctual/light");
    none.gltf.erase("extensions");
    EXPECT_EQ(errorOf(none).where(), "/nodes/1/extensions/KHR_lights_punctual/light");
    GltfBuilder empty = lit(Json::array());
    empty.gltf["extensions"]["KHR_lights_punctual"] = Json::object();
    empty.gltf["nodes"].erase(1);
    empty.gltf["scenes"][0]["nodes"].erase(1);
    EXPECT_EQ(errorOf(empty).where(), "/extensions/KHR_lights_punctual");
}

}  // namespace
}  // namespace peeler::test
