// SPDX-License-Identifier: Apache-2.0
#include "cmd/info/info_scene.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "cmd/cli/errors.h"
#include "cmd/cli/option_names.h"
#include "cmd/cli/report.h"
#include "cmd/info/info_options.h"
#include "cmd/machine/resources.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/scene_options.h"
#include "core/base/printable.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"
#include "core/splats/splat_bounds.h"
#include "formats/file/content_hash.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler::cmd {

namespace {

/// The number of drawn elements of each type.
struct Elements {
    std::uint64_t triangles = 0, lines = 0, points = 0, splats = 0;

    Elements& operator+=(const Elements& other) {
        triangles += other.triangles;
        lines += other.lines;
        points += other.points;
        splats += other.splats;
        return *this;
    }
};

/// The number of elements in a primitive of n vertices. Rows are in the order of Topology.
struct TopologyRow {
    std::uint64_t Elements::*kind;
    std::uint64_t (*count)(std::uint64_t vertices);
};
constexpr TopologyRow kTopologies[] = {
    {&Elements::points, [](std::uint64_t n) { return n; }},
    {&Elements::lines, [](std::uint64_t n) { return n / 2; }},
    {&Elements::lines, [](std::uint64_t n) { return n > 1 ? n : 0; }},
    {&Elements::lines, [](std::uint64_t n) { return n > 1 ? n - 1 : 0; }},
    {&Elements::triangles, [](std::uint64_t n) { return n / 3; }},
    {&Elements::triangles, [](std::uint64_t n) { return n > 2 ? n - 2 : 0; }},
    {&Elements::triangles, [](std::uint64_t n) { return n > 2 ? n - 2 : 0; }},
};

Elements elementsOf(const Mesh& mesh) {
    Elements sum;
    for (const Primitive& primitive : mesh.primitives) {
        const auto vertices =
            primitive.indices.empty() ? primitive.positions.size() : primitive.indices.size();
        const TopologyRow& row = kTopologies[static_cast<std::size_t>(primitive.topology)];
        sum.*(primitive.splats ? &Elements::splats : row.kind) += row.count(vertices);
    }
    return sum;
}

/// Returns the highest degree of spherical harmonics.
int splatDegree(const PosedScene& shown) {
    int degree = 0;
    for (const MeshInstance& instance : shown.meshes())
        for (const Primitive& primitive : shown.primitives(instance))
            if (primitive.splats) degree = std::max(degree, primitive.splats->degree);
    return degree;
}

constexpr std::array<const char*, 3> kAlphaModes = {"OPAQUE", "MASK", "BLEND"};

std::array<std::uint64_t, 3> materialsByAlphaMode(const Scene& scene) {
    std::array<std::uint64_t, 3> counts{};
    // The last material is glTF's default material, which the file does not contain.
    for (std::size_t i = 0; i + 1 < scene.materials.size(); ++i) {
        ++counts[static_cast<std::size_t>(scene.materials[i].alpha_mode)];
    }
    return counts;
}

struct ExtensionUse {
    std::string name;
    bool required, supported;
    std::string note;
};

std::vector<ExtensionUse> extensionsOf(const Scene& scene) {
    std::vector<ExtensionUse> uses;
    for (const std::string& name : scene.extensions_used) {
        const auto& required = scene.extensions_required;
        ExtensionUse use{name, std::find(required.begin(), required.end(), name) != required.end(),
                         false, "not known"};
        for (const GltfExtension& known : gltfExtensions()) {
            if (name != known.name) continue;
            use.supported = known.supported;
            use.note = known.note;
        }
        uses.push_back(use);
    }
    return uses;
}

struct SceneFacts {
    Scene scene;
    std::string format;
    std::optional<Assumed> assumed;
    Elements elements;
    int splat_degree = 0;
    std::optional<Bounds> splat_bounds;  ///< to three standard deviations
    std::optional<Bounds> box;
    std::vector<CameraInstance> cameras;  ///< cameras of the selected scene
    std::vector<std::string> camera_names;
    std::vector<PlacedLight> lights;  ///< lights of the selected scene, without the built-in light
    std::vector<ExtensionUse> extensions;
    std::array<std::uint64_t, 3> materials{};
};

SceneFacts gather(const InfoOptions& options) {
    SceneFacts facts;
    SceneRequest request;
    request.scene = options.scene;
    request.appearance = options.appearance;
    request.memory = inheritedBudget();
    request.scene.file = options.file;
    // Ignores textures that cannot be decoded, because the output does not depend on their content.
    std::vector<std::string>& ignored = request.scene.reading.ignored_extensions;
    for (const std::string& extension : undecodedImageExtensions())
        ignored.push_back(extension);
    facts.scene = loadScene(request);
    if (const SceneFormat* const format = sceneFormatOf(options.file)) facts.format = format->name;
    facts.assumed = assumedOf(options.file, request.scene.reading);
    facts.scene.default_scene = chooseScene(facts.scene, request.scene);
    selectNodes(facts.scene, request.scene);
    if (const auto& to = request.scene.normalize)
        normalizeScene(facts.scene, facts.scene.default_scene, *to);
    const PosedScene shown(facts.scene);
    for (const MeshInstance& instance : shown.meshes()) {
        facts.elements += elementsOf(facts.scene.meshes[static_cast<std::size_t>(instance.mesh)]);
    }
    facts.splat_degree = splatDegree(shown);
    facts.splat_bounds = splatBounds(shown);
    facts.box = shown.bounds();
    facts.cameras = shown.cameras();
    facts.camera_names = cameraNames(shown);
    if (!shown.lights().empty()) facts.lights = placedLights(shown);
    facts.extensions = extensionsOf(facts.scene);
    facts.materials = materialsByAlphaMode(facts.scene);
    return facts;
}

Json cameraJson(const Camera& camera) {
    Json json;
    json["projection"] = camera.perspective ? "perspective" : "orthographic";
    if (camera.perspective) {
        json["yfov"] = camera.yfov;
        json["aspectRatio"] = camera.aspect_ratio ? Json(*camera.aspect_ratio) : Json();
    } else {
        json["xmag"] = camera.xmag;
        json["ymag"] = camera.ymag;
    }
    json["near"] = camera.znear;
    json["far"] = camera.zfar ? Json(*camera.zfar) : Json();
    return json;
}

constexpr std::array<const char*, 3> kLightTypes = {"directional", "point", "spot"};

const char* typeOf(const Light& light) {
    return kLightTypes[static_cast<std::size_t>(light.type)];
}

Json lightJson(const PlacedLight& placed) {
    const Light& light = placed.light;
    Json json;
    json["name"] = placed.name;
    json["type"] = typeOf(light);
    json["color"] = vectorJson(light.color);
    json["intensity"] = light.intensity;
    json["range"] = light.range ? Json(*light.range) : Json();
    if (light.type == LightType::kSpot) {
        json["innerConeAngle"] = light.inner_cone;
        json["outerConeAngle"] = light.outer_cone;
    }
    return json;
}

std::string lightText(const PlacedLight& placed) {
    char strength[64];
    std::snprintf(strength, sizeof strength, ", %.6g %s", placed.light.intensity,
                  placed.light.type == LightType::kDirectional ? "lx" : "cd");
    return printable(placed.name) + ", " + typeOf(placed.light) + strength;
}

Json nodeJson(const Scene& scene, const Node& node) {
    Json json;
    json["name"] = node.name;
    json["children"] = node.children;
    json["mesh"] = node.mesh >= 0 ? Json(node.mesh) : Json();
    json["camera"] = node.camera >= 0 ? Json(node.camera) : Json();
    json["light"] = node.light >= 0 ? Json(node.light) : Json();
    json["skin"] = node.skin >= 0 ? Json(node.skin) : Json();
    json["instances"] = node.instances ? Json(node.instances->size()) : Json();
    json["visible"] = node.visible;
    if (node.mesh >= 0) {
        const Elements elements = elementsOf(scene.meshes[static_cast<std::size_t>(node.mesh)]);
        json["triangles"] = elements.triangles;
        json["lines"] = elements.lines;
        json["points"] = elements.points;
        json["splats"] = elements.splats;
    }
    return json;
}

constexpr std::array<const char*, 4> kProperties = {"translation", "rotation", "scale", "weights"};

Json animationJson(const Scene& scene, std::size_t index) {
    const Animation& animation = scene.animations[index];
    Json json;
    json["name"] = animationName(scene, index);
    json["duration"] = durationOf(animation);
    json["channels"] = Json::array();
    for (const AnimationChannel& channel : animation.channels) {
        json["channels"].push_back(
            {{"node", channel.node},
             {"property", kProperties[static_cast<std::size_t>(channel.property)]},
             {"keys", animation.keyframes[channel.keyframes].times.size()}});
    }
    return json;
}

std::string animationText(const Scene& scene, std::size_t index) {
    const Animation& animation = scene.animations[index];
    char duration[32];
    std::snprintf(duration, sizeof duration, ", %.6g s, ", durationOf(animation));
    return printable(animationName(scene, index)) + duration +
           countText(animation.channels.size(), "channel");
}

Json boxJson(const Bounds& box) {
    return {{"min", vectorJson(box.min)}, {"max", vectorJson(box.max)}};
}

Json toJson(const SceneFacts& facts, const InfoOptions& options) {
    const Scene& scene = facts.scene;
    Json json;
    json["kind"] = "scene";
    json["file"] = options.file.string();
    if (facts.assumed) {
        json["format"] = facts.assumed->format;
        json["up"] = axisName(facts.assumed->up);
        json["metresPerUnit"] = facts.assumed->metres_per_unit;
    }
    json["generator"] = scene.generator;
    json["copyright"] = scene.copyright;
    json["hash"] = hexText(scene.content_hash);
    json["defaultScene"] = scene.default_scene;
    json["scenes"] = Json::array();
    for (const SceneRoots& roots : scene.scenes) {
        json["scenes"].push_back({{"name", roots.name}, {"roots", roots.roots}});
    }
    json["nodes"] = Json::array();
    for (const Node& node : scene.nodes)
        json["nodes"].push_back(nodeJson(scene, node));
    json["triangles"] = facts.elements.triangles;
    json["lines"] = facts.elements.lines;
    json["points"] = facts.elements.points;
    json["splats"] = facts.elements.splats;
    json["splatDegree"] = facts.splat_bounds ? Json(facts.splat_degree) : Json();
    json["splatBounds"] = facts.splat_bounds ? boxJson(*facts.splat_bounds) : Json();
    for (std::size_t i = 0; i < kAlphaModes.size(); ++i) {
        json["materials"][kAlphaModes[i]] = facts.materials[i];
    }
    json["textures"] = Json::array();
    for (const Image& image : scene.images) {
        json["textures"].push_back({{"name", image.name},
                                    {"width", image.width},
                                    {"height", image.height},
                                    {"codec", image.codec}});
    }
    json["cameras"] = Json::array();
    for (std::size_t i = 0; i < facts.cameras.size(); ++i) {
        Json camera;
        camera["name"] = facts.camera_names[i];
        camera.update(cameraJson(scene.cameras[static_cast<std::size_t>(facts.cameras[i].camera)]));
        json["cameras"].push_back(camera);
    }
    json["lights"] = Json::array();
    for (const PlacedLight& light : facts.lights)
        json["lights"].push_back(lightJson(light));
    json["animations"] = Json::array();
    for (std::size_t i = 0; i < scene.animations.size(); ++i)
        json["animations"].push_back(animationJson(scene, i));
    json["skins"] = Json::array();
    for (const Skin& skin : scene.skins)
        json["skins"].push_back({{"name", skin.name}, {"joints", skin.joints}});
    json["variants"] = scene.variants;
    const IdNames names = idNames(scene);
    json["objectNames"] = names.objects;
    json["materialNames"] = names.materials;
    json["bounds"] = facts.box ? boxJson(*facts.box) : Json();
    json["extensions"] = Json::array();
    for (const ExtensionUse& use : facts.extensions) {
        json["extensions"].push_back({{"name", use.name},
                                      {"required", use.required},
                                      {"supported", use.supported},
                                      {"note", use.note}});
    }
    json["warnings"] = Json::array();
    for (const Text& warning : scene.warnings)
        json["warnings"].push_back(inOptions(warning));
    return json;
}

std::string elementsText(const Elements& elements) {
    std::string text;
    const std::pair<std::uint64_t, const char*> kinds[] = {{elements.triangles, "triangle"},
                                                           {elements.lines, "line"},
                                                           {elements.points, "point"},
                                                           {elements.splats, "splat"}};
    for (const auto& [count, noun] : kinds) {
        if (count != 0) text += (text.empty() ? "" : ", ") + countText(count, noun);
    }
    return text.empty() ? "nothing" : text;
}

std::string boundsText(const Bounds& box) {
    return vectorText(box.min) + " to " + vectorText(box.max);
}

/// Returns the default scene's node tree, indented. The function is not recursive, because nodes
/// may be nested to any depth.
std::string treeText(const Scene& scene) {
    std::string text;
    std::vector<std::pair<int, std::size_t>> open;  // stack of nodes with their depths
    const auto push = [&](const std::vector<int>& nodes, std::size_t depth) {
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
            open.emplace_back(*node, depth);
    };
    push(scene.scenes[static_cast<std::size_t>(scene.default_scene)].roots, 1);
    while (!open.empty()) {
        const auto [index, depth] = open.back();
        open.pop_back();
        const Node& node = scene.nodes[static_cast<std::size_t>(index)];
        // Without a limit, the indentation would make the text grow quadratically with depth.
        text += std::string(2 * std::min<std::size_t>(depth, 40), ' ');
        text += printable(nodeName(scene, static_cast<std::size_t>(index)));
        if (node.mesh >= 0) {
            text +=
                ": " + elementsText(elementsOf(scene.meshes[static_cast<std::size_t>(node.mesh)]));
        }
        if (node.instances && node.mesh >= 0)
            text += " at " + countText(node.instances->size(), "place");
        if (node.skin >= 0) text += " [skin]";
        if (node.camera >= 0) text += " [camera]";
        if (node.light >= 0) text += " [light]";
        if (!node.visible) text += " [hidden]";
        text += '\n';
        push(node.children, depth + 1);
    }
    return text;
}

std::string toText(const SceneFacts& facts, const InfoOptions& options) {
    const Scene& scene = facts.scene;
    std::string text =
        printable(options.file.string(), kMostOfLine) + ": " + facts.format + " scene";
    if (!scene.generator.empty()) text += ", written by " + printable(scene.generator);
    if (facts.assumed) {
        char unit[64];
        std::snprintf(unit, sizeof unit, " is up, a unit is %.6g m",
                      facts.assumed->metres_per_unit);
        text +=
            "\n"
            "assumed: " +
            axisName(facts.assumed->up) + unit;
    }
    text += "\ndraws: " + elementsText(facts.elements) + '\n';
    if (facts.splat_bounds)
        text += "splats: spherical harmonics of degree " + std::to_string(facts.splat_degree) +
                ", to 3 sigma " + boundsText(*facts.splat_bounds) + '\n';
    text += "materials:";
    for (std::size_t i = 0; i < kAlphaModes.size(); ++i) {
        text += (i == 0 ? " " : ", ") + groupedText(facts.materials[i]) + ' ' + kAlphaModes[i];
    }
    text += "\ntextures: " + groupedText(scene.images.size()) + '\n';
    for (const Image& image : scene.images) {
        text += "  " + std::to_string(image.width) + " x " + std::to_string(image.height) + "  " +
                image.codec + (image.name.empty() ? "" : "  ") + printable(image.name) + '\n';
    }
    text += "bounds: " + (facts.box ? boundsText(*facts.box) : "none") + '\n';
    text += "scenes:\n";
    for (std::size_t i = 0; i < scene.scenes.size(); ++i) {
        text += "  " + std::to_string(i) + "  " + printable(scene.scenes[i].name) +
                (static_cast<int>(i) == scene.default_scene ? " (default)" : "") + '\n';
    }
    text += facts.cameras.empty() ? "cameras: none\n" : "cameras:\n";
    for (std::size_t i = 0; i < facts.cameras.size(); ++i) {
        const auto camera = static_cast<std::size_t>(facts.cameras[i].camera);
        text += "  " + std::to_string(i) + "  " + printable(facts.camera_names[i]) +
                (scene.cameras[camera].perspective ? ", perspective\n" : ", orthographic\n");
    }
    text += facts.lights.empty() ? "lights: none\n" : "lights:\n";
    for (std::size_t i = 0; i < facts.lights.size(); ++i)
        text += "  " + std::to_string(i) + "  " + lightText(facts.lights[i]) + '\n';
    text += scene.animations.empty() ? "animations: none\n" : "animations:\n";
    for (std::size_t i = 0; i < scene.animations.size(); ++i)
        text += "  " + std::to_string(i) + "  " + animationText(scene, i) + '\n';
    if (!scene.variants.empty()) text += "variants:\n";
    for (std::size_t i = 0; i < scene.variants.size(); ++i)
        text += "  " + std::to_string(i) + "  " + printable(scene.variants[i]) + '\n';
    text += facts.extensions.empty() ? "extensions: none\n" : "extensions:\n";
    for (const ExtensionUse& use : facts.extensions) {
        text += "  " + printable(use.name) + (use.supported ? ": supported" : ": not supported") +
                (use.required ? ", required" : "") + " (" + use.note + ")\n";
    }
    return text + "nodes:\n" + treeText(scene);
}

}  // namespace

std::string vectorText(const glm::dvec3& v) {
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "(%.6g, %.6g, %.6g)", v.x, v.y, v.z);
    return text.data();
}

Json vectorJson(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

void printSceneInfo(const InfoOptions& options, Reporter& reporter) {
    const SceneFacts facts = gather(options);
    if (options.json) {
        reporter.result(toJson(facts, options));
        return;
    }
    for (const Text& warning : facts.scene.warnings)
        reporter.warning(warning);
    reporter.text(toText(facts, options));
}

}  // namespace peeler::cmd
