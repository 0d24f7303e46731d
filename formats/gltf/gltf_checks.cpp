// SPDX-License-Identifier: Apache-2.0
// What glTF 2.0 demands beyond types and indices: versions, extensions, the node forest, cameras.
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "formats/file/json_text.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

// Real scenes nest tens of levels, a skeleton a hundred.
constexpr std::size_t kMaxNodeDepth = 10000;

bool isVersion2(const json& version, bool only_2_0) {
    if (!version.is_string()) return false;
    const std::string& text = version.get_ref<const std::string&>();
    return only_2_0 ? text == "2.0" : text == "2" || text.rfind("2.", 0) == 0;
}

/// Fails with the first node of the ring that this node is in.
[[noreturn]] void failRing(const std::vector<int>& parents, std::size_t node) {
    std::size_t first = node;
    for (auto next = static_cast<std::size_t>(parents[node]); next != node;
         next = static_cast<std::size_t>(parents[next]))
        first = std::min(first, next);
    failGltf("the node is its own ancestor", childPointer("/nodes", first));
}

/// The member of an object that is an array; an empty array without it.
const json& listOf(const json& object, const char* member) {
    static const json kNone = json::array();
    const auto found = object.find(member);
    return found == object.end() ? kNone : *found;
}

/// The parent of each node, −1 = none.
std::vector<int> parentsOf(const json& nodes) {
    std::vector<int> parents(nodes.size(), -1);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const json& children = listOf(nodes[i], "children");
        for (std::size_t j = 0; j < children.size(); ++j) {
            const auto child = children[j].get<std::size_t>();
            if (parents[child] >= 0)
                failGltf("node " + std::to_string(child) + " is already a child of node " +
                             std::to_string(parents[child]) + ", a node has one parent at most",
                         childPointer(childPointer("/nodes", i) + "/children", j));
            parents[child] = static_cast<int>(i);
        }
    }
    return parents;
}

/// Following parents ends at a root, after not too many.
void checkDepths(const std::vector<int>& parents) {
    const std::size_t count = parents.size();
    // Every chain of parents is walked once: where a node's depth is known, its parents' are.
    std::vector<std::size_t> depths(count, 0);  // 1 = a root, 0 = not known yet
    std::vector<std::size_t> chain;
    for (std::size_t i = 0; i < count; ++i) {
        chain.clear();
        std::size_t node = i, depth = 0;
        while (depths[node] == 0) {
            chain.push_back(node);
            if (chain.size() > count) failRing(parents, node);
            if (parents[node] < 0) break;
            node = static_cast<std::size_t>(parents[node]);
        }
        depth = depths[node];
        for (auto next = chain.rbegin(); next != chain.rend(); ++next)
            depths[*next] = ++depth;
        if (depth > kMaxNodeDepth)
            failGltf(
                "the nodes are nested deeper than " + std::to_string(kMaxNodeDepth) + " levels",
                childPointer("/nodes", i), "no exporter writes such a scene; flatten it");
    }
}

void checkRoots(const json& scenes, const std::vector<int>& parents) {
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        const json& roots = listOf(scenes[i], "nodes");
        std::vector<char> listed(parents.size(), 0);
        for (std::size_t j = 0; j < roots.size(); ++j) {
            const auto root = roots[j].get<std::size_t>();
            const std::string where = childPointer(childPointer("/scenes", i) + "/nodes", j);
            if (parents[root] >= 0)
                failGltf("node " + std::to_string(root) + " is a child of node " +
                             std::to_string(parents[root]) + ", a scene lists root nodes only",
                         where);
            if (listed[root]) failGltf("node " + std::to_string(root) + " is listed twice", where);
            listed[root] = 1;
        }
    }
}

}  // namespace

void checkGltfForest(const json& gltf) {
    const std::vector<int> parents = parentsOf(listOf(gltf, "nodes"));
    checkDepths(parents);
    checkRoots(listOf(gltf, "scenes"), parents);
}

void checkGltfCameras(const tinygltf::Model& model) {
    for (std::size_t i = 0; i < model.cameras.size(); ++i) {
        const tinygltf::Camera& camera = model.cameras[i];
        const std::string where = childPointer(childPointer("/cameras", i), camera.type);
        if (camera.type == "perspective") {
            const tinygltf::PerspectiveCamera& lens = camera.perspective;
            if (lens.yfov >= std::numbers::pi)
                failGltf("the vertical field of view must be below pi radians, it is " +
                             std::to_string(lens.yfov),
                         where + "/yfov", "glTF gives angles in radians");
            // 0 is tinygltf's "no far plane"; the schema check has refused a written 0.
            if (lens.zfar != 0 && lens.zfar <= lens.znear)
                failGltf("zfar must be greater than znear", where + "/zfar");
        } else {
            const tinygltf::OrthographicCamera& lens = camera.orthographic;
            if (lens.znear < 0) failGltf("znear must not be negative", where + "/znear");
            if (lens.zfar <= lens.znear)
                failGltf("zfar must be greater than znear", where + "/zfar");
        }
    }
}

void checkGltfVersion(const json& gltf, const std::string& path) {
    if (!gltf.is_object() || !gltf.contains("asset") || !gltf["asset"].is_object())
        failGltf("this JSON is not glTF: it has no \"asset\" object", path,
                 "a scene is a .gltf or .glb file");
    const json& asset = gltf["asset"];
    if (!asset.contains("version")) failGltf("the glTF version is missing", "/asset");
    if (!isVersion2(asset["version"], false))
        failGltf("the file is glTF " + shownJson(asset["version"]) + ", only 2.x is read",
                 "/asset/version", "convert it to glTF 2.0");
    if (asset.contains("minVersion") && !isVersion2(asset["minVersion"], true))
        failGltf("the file needs a reader of glTF " + shownJson(asset["minVersion"]) +
                     ", this one reads 2.0",
                 "/asset/minVersion", "export it as glTF 2.0");
}

void checkRequiredExtensions(const json& gltf, const std::vector<std::string>& ignored) {
    const auto required = gltf.find("extensionsRequired");
    if (required == gltf.end() || !required->is_array()) return;  // the schema check says more
    for (std::size_t i = 0; i < required->size(); ++i) {
        if (!(*required)[i].is_string()) continue;
        const std::string& name = (*required)[i].get_ref<const std::string&>();
        if (std::ranges::find(ignored, name) != ignored.end()) continue;
        const std::vector<GltfExtension>& known = supportedGltfExtensions();
        if (std::none_of(known.begin(), known.end(),
                         [&](const GltfExtension& extension) { return name == extension.name; }))
            failGltf(
                "the file requires the glTF extension " + name + ", which is not supported",
                childPointer("/extensionsRequired", i),
                "export it without this extension, or go on without it: `ignored_extensions` " +
                    name);
    }
}

}  // namespace peeler
