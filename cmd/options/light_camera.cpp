// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/light_camera.h"

#include <string_view>
#include <vector>

#include "cmd/cli/choices.h"
#include "core/base/error.h"
#include "core/scene/lights.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kPrefix = "light:";

const PlacedLight& chooseLight(const std::vector<PlacedLight>& lights, const std::string& camera) {
    std::vector<std::vector<std::string>> names;
    std::vector<std::string> listed;
    for (const PlacedLight& light : lights) {
        names.push_back({light.name, light.node_name});
        listed.push_back(std::string(kPrefix) + light.name);
    }
    if (const auto found = findNameOrIndex(camera.substr(kPrefix.size()), names))
        return lights[*found];
    if (lights.empty()) {
        throw Error(ErrorKind::kUsage,
                    "the scene has no lights of its own, and with an environment "
                    "none is built in",
                    "--camera " + camera, "leave --environment out");
    }
    throw Error(
        ErrorKind::kUsage, "unknown light", "--camera " + camera,
        choiceHint(camera, "lights", std::vector<std::string_view>(listed.begin(), listed.end())) +
            "; or an index from light:0 to light:" + std::to_string(lights.size() - 1));
}

}  // namespace

bool namesLight(const std::string& camera) {
    return camera.starts_with(kPrefix);
}

View lightCamera(const PosedScene& posed, const std::string& camera) {
    const std::vector<PlacedLight> lights = placedLights(posed);
    const PlacedLight& light = chooseLight(lights, camera);
    if (light.light.type == LightType::kPoint) {
        throw Error(ErrorKind::kUsage, "a point light shines all around, so it has no view",
                    "--camera " + camera, "choose a directional or a spot light");
    }
    const auto view = lightView(light, posed);
    if (!view) {
        throw Error(ErrorKind::kInput, "the scene has no vertices to fit the light's view to",
                    "--camera " + camera);
    }
    return *view;
}

}  // namespace peeler::cmd
