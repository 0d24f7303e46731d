// SPDX-License-Identifier: Apache-2.0
// Reader of the lights of a glTF file (KHR_lights_punctual).
#include "formats/gltf/gltf_parts.h"

#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "KHR_lights_punctual";
constexpr const char* kLights = "/extensions/KHR_lights_punctual/lights";

constexpr std::pair<const char*, LightType> kLightTypes[] = {
    {"directional", LightType::kDirectional},
    {"point", LightType::kPoint},
    {"spot", LightType::kSpot}};

std::optional<LightType> typeNamed(const std::string& text) {
    for (const auto& [name, type] : kLightTypes)
        if (text == name) return type;
    return std::nullopt;
}

void readCone(const json& source, const std::string& where, Light& light) {
    const auto spot = source.find("spot");
    if (spot == source.end()) failGltf("the required property \"spot\" is missing", where);
    light.inner_cone = spot->value("innerConeAngle", light.inner_cone);
    light.outer_cone = spot->value("outerConeAngle", light.outer_cone);
    // Allow for rounding: exporters write pi/2 rounded to a float, and equal angles for a cone with
    // a hard edge.
    constexpr double kHalfSpace = std::numbers::pi / 2 * (1 + 1e-6);
    if (light.outer_cone > kHalfSpace)
        failGltf("the outer cone angle must be at most pi/2 radians, but is " +
                     std::to_string(light.outer_cone),
                 where + "/spot/outerConeAngle");
    if (light.inner_cone < 0 || light.inner_cone > light.outer_cone)
        failGltf("the inner cone angle must lie between 0 and the outer one, " +
                     std::to_string(light.outer_cone) + " radians, but is " +
                     std::to_string(light.inner_cone),
                 where + "/spot/innerConeAngle");
}

Light readLight(const json& source, LightType type, const std::string& where) {
    Light light;
    if (const auto name = source.find("name"); name != source.end() && name->is_string())
        light.name = name->get<std::string>();
    light.type = type;
    if (const auto color = source.find("color"); color != source.end()) {
        for (int c = 0; c < 3; ++c) {
            light.color[c] = (*color)[static_cast<std::size_t>(c)].get<double>();
            if (light.color[c] < 0)
                failGltf("a colour must not be negative",
                         childPointer(where + "/color", static_cast<std::size_t>(c)));
        }
    }
    light.intensity = source.value("intensity", light.intensity);
    if (light.intensity < 0) failGltf("the intensity must not be negative", where + "/intensity");
    if (type != LightType::kDirectional && source.contains("range"))
        light.range = source["range"].get<double>();
    if (type == LightType::kSpot) readCone(source, where, light);
    return light;
}

}  // namespace

void readGltfLights(const json& gltf, GltfDocument& document) {
    // For each light in the file, its index in document.lights; −1 for skipped lights.
    std::vector<int> read;
    if (const json::json_pointer lights(kLights); gltf.contains(lights)) {
        for (const json& source : gltf[lights]) {
            const std::string where = childPointer(kLights, read.size());
            const std::string type = source["type"].get<std::string>();
            if (const auto known = typeNamed(type)) {
                read.push_back(static_cast<int>(document.lights.size()));
                document.lights.push_back(readLight(source, *known, where));
            } else {
                read.push_back(-1);
                document.warn("The light " + where + " has an unknown type; it is off.");
            }
        }
    }
    const auto nodes = gltf.find("nodes");
    if (nodes == gltf.end()) return;
    for (const json& node : *nodes) {
        const json::json_pointer light(std::string("/extensions/") + kExtension + "/light");
        document.node_lights.push_back(node.contains(light) ? read[node[light].get<std::size_t>()]
                                                            : -1);
    }
}

}  // namespace peeler
