// SPDX-License-Identifier: Apache-2.0
// Checks of glTF 2.0 rules beyond types and indices: versions, extensions, the node forest,
// cameras.
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "formats/file/json_text.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

// The maximum depth of nodes. Real scenes nest tens of levels, and skeletons up to a hundred.
constexpr std::size_t kMaxNodeDepth = 10000;

bool isVersion2(const json& version, bool only_2_0) {
    if (!version.is_string()) return false;
    const std::string& text = version.get_ref<const std::string&>();
    return only_2_0 ? text == "2.0" : text == "2" || text.rfind("2.", 0) == 0;
}

/// Converts a version that is a number, such as 2.0, to a string.
void readVersionNumber(json& asset, const char* name, ReadWarnings& warnings) {
    const auto found = asset.find(name);
    if (found == asset.end() || !found->is_number()) return;
    const double number = found->get<double>();
    *found = number == 2 ? "2.0" : dumpJson(*found);
    warnings.warn("The glTF version is a number instead of a string (TYPE_MISMATCH).",
                  childPointer("/asset", name));
}

/// Throws Error (kInput), naming the node with the smallest index in the cycle that contains
/// `node`.
[[noreturn]] void failRing(const std::vector<int>& parents, std::size_t node) {
    std::size_t first = node;
    for (auto next = static_cast<std::size_t>(parents[node]); next != node;
         next = static_cast<std::size_t>(parents[next]))
        first = std::min(first, next);
    failGltf("the node is its own ancestor", childPointer("/nodes", first));
}

/// Returns an array member of an object, or an empty array if the object lacks the member.
const json& listOf(const json& object, const char* member) {
    static const json kNone = json::array();
    const auto found = object.find(member);
    return found == object.end() ? kNone : *found;
}

/// Returns the parent of each node; −1 for roots.
std::vector<int> parentsOf(const json& nodes) {
    std::vector<int> parents(nodes.size(), -1);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const json& children = listOf(nodes[i], "children");
        for (std::size_t j = 0; j < children.size(); ++j) {
            const auto child = children[j].get<std::size_t>();
            if (parents[child] >= 0)
                failGltf("node " + std::to_string(child) + " is already a child of node " +
                             std::to_string(parents[child]) + "; a node has at most one parent",
                         childPointer(childPointer("/nodes", i) + "/children", j));
            parents[child] = static_cast<int>(i);
        }
    }
    return parents;
}

/// Checks that every chain of parents ends at a root and is not longer than allowed.
void checkDepths(const std::vector<int>& parents) {
    const std::size_t count = parents.size();
    // Walk each chain only once: stop at a node whose depth is known.
    std::vector<std::size_t> depths(count, 0);  // depth of each node: 1 for roots, 0 if unknown
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
                childPointer("/nodes", i), "flatten the hierarchy of nodes");
    }
}

/// The mark of a node, and the answers that isMarked() has stored: kMarked if the node itself is
/// marked, kBelow if an ancestor is marked, kFree otherwise.
enum class Mark : std::uint8_t { kUnknown, kMarked, kBelow, kFree };

/// Whether a node or one of its ancestors is marked. Stores the answer for all nodes on the way up.
bool isMarked(const std::vector<int>& parents, std::vector<Mark>& marks, std::size_t first) {
    const auto markOf = [&](int node) -> Mark& { return marks[static_cast<std::size_t>(node)]; };
    int node = static_cast<int>(first);
    while (node >= 0 && markOf(node) == Mark::kUnknown)
        node = parents[static_cast<std::size_t>(node)];
    const Mark answer = node < 0 || markOf(node) == Mark::kFree ? Mark::kFree : Mark::kBelow;
    for (int at = static_cast<int>(first); at != node; at = parents[static_cast<std::size_t>(at)])
        markOf(at) = answer;
    return answer == Mark::kBelow;
}

/// Checks the roots of the scene at `where`, and marks them in `shown`. Warns if a listed node has
/// a parent; the scene shows the node as a root, without the parent's transform. Throws Error
/// (kInput) if the scene also lists one of the node's ancestors.
void readRoots(json& roots, const std::string& where, const std::vector<int>& parents,
               std::vector<Mark>& shown, ReadWarnings& warnings) {
    std::vector<Mark> listed(parents.size(), Mark::kUnknown);
    for (const json& root : roots)
        listed[root.get<std::size_t>()] = shown[root.get<std::size_t>()] = Mark::kMarked;
    json once = json::array();
    std::vector<char> taken(parents.size(), 0);
    for (std::size_t i = 0; i < roots.size(); ++i) {
        const auto root = roots[i].get<std::size_t>();
        const std::string place = childPointer(where + "/nodes", i);
        if (taken[root]) {
            warnings.warn("The scene " + where +
                              " lists a node twice (DUPLICATE_ELEMENTS); it is shown once.",
                          place);
            continue;
        }
        const int parent = parents[root];
        if (parent >= 0 && isMarked(parents, listed, static_cast<std::size_t>(parent)))
            failGltf("node " + std::to_string(root) +
                         " is a descendant of another node that the scene lists",
                     place);
        if (parent >= 0)
            warnings.warn("The scene " + where + " lists a node that is a child of another one " +
                              "(SCENE_NON_ROOT_NODE); it is shown as a root.",
                          place);
        taken[root] = 1;
        once.push_back(root);
    }
    roots = std::move(once);
}

/// Removes each node that a scene lists as a root from the children of its parent, unless a scene
/// shows the parent.
void cutRoots(json& nodes, const std::vector<int>& parents, const std::vector<Mark>& listed) {
    std::vector<Mark> shown = listed;
    for (std::size_t i = 0; i < parents.size(); ++i) {
        const auto children = nodes[i].find("children");
        if (children == nodes[i].end() || isMarked(parents, shown, i)) continue;
        std::erase_if(children->get_ref<json::array_t&>(), [&](const json& child) {
            return listed[child.get<std::size_t>()] == Mark::kMarked;
        });
    }
}

/// Collects the member names of all "extensions" objects, at any depth. Skips extras, which are not
/// part of glTF.
void addExtensions(const json& value, std::set<std::string>& names) {
    if (!value.is_structured()) return;
    for (const auto& [key, member] : value.items()) {
        if (value.is_object() && key == "extras") continue;
        if (value.is_object() && key == "extensions" && member.is_object())
            for (const auto& [name, extension] : member.items())
                names.insert(name);
        addExtensions(member, names);
    }
}

}  // namespace

void checkGltfForest(json& gltf, ReadWarnings& warnings) {
    const std::vector<int> parents = parentsOf(listOf(gltf, "nodes"));
    checkDepths(parents);
    const auto scenes = gltf.find("scenes");
    if (scenes == gltf.end()) return;
    std::vector<Mark> listed(parents.size(), Mark::kUnknown);
    for (std::size_t i = 0; i < scenes->size(); ++i) {
        const auto roots = (*scenes)[i].find("nodes");
        if (roots == (*scenes)[i].end()) continue;
        readRoots(*roots, childPointer("/scenes", i), parents, listed, warnings);
    }
    if (!parents.empty()) cutRoots(gltf["nodes"], parents, listed);
}

std::vector<std::string> undeclaredExtensions(const json& gltf) {
    std::set<std::string> names;
    addExtensions(gltf, names);
    for (const json& name : listOf(gltf, "extensionsUsed"))
        names.erase(name.get<std::string>());
    return {names.begin(), names.end()};
}

void warnOfTwoPlaces(const json& gltf, ReadWarnings& warnings) {
    const json& nodes = listOf(gltf, "nodes");
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!nodes[i].contains("matrix")) continue;
        for (const char* other : {"translation", "rotation", "scale"})
            if (nodes[i].contains(other))
                warnings.warn("The node " + childPointer("/nodes", i) + " has a matrix and a " +
                                  other + " (NODE_MATRIX_TRS); the matrix is used.",
                              childPointer("/nodes", i));
    }
}

void warnOfEmptyParts(const json& gltf, ReadWarnings& warnings) {
    constexpr struct {
        const char *list, *size;
    } kSizes[] = {{"buffers", "byteLength"}, {"bufferViews", "byteLength"}, {"accessors", "count"}};
    for (const auto& [list, size] : kSizes) {
        const json& parts = listOf(gltf, list);
        for (std::size_t i = 0; i < parts.size(); ++i)
            if (parts[i][size] == 0)
                warnings.warn("The " + std::string(size) + " of " +
                                  childPointer('/' + std::string(list), i) +
                                  " is 0 (VALUE_NOT_IN_RANGE).",
                              childPointer('/' + std::string(list), i));
    }
}

void checkGltfCameras(const tinygltf::Model& model) {
    for (std::size_t i = 0; i < model.cameras.size(); ++i) {
        const tinygltf::Camera& camera = model.cameras[i];
        const std::string where = childPointer(childPointer("/cameras", i), camera.type);
        if (camera.type == "perspective") {
            const tinygltf::PerspectiveCamera& lens = camera.perspective;
            if (lens.yfov >= std::numbers::pi)
                failGltf("the vertical field of view must be below pi radians, but is " +
                             std::to_string(lens.yfov),
                         where + "/yfov", "glTF gives angles in radians");
            // In tinygltf, 0 means that there is no far plane. The schema check has rejected an
            // explicit 0.
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

void checkGltfVersion(json& gltf, const std::string& path, ReadWarnings& warnings) {
    if (!gltf.is_object() || !gltf.contains("asset") || !gltf["asset"].is_object())
        failGltf("this JSON is not glTF: it has no \"asset\" object", path,
                 "a scene is a .gltf or .glb file");
    json& asset = gltf["asset"];
    readVersionNumber(asset, "version", warnings);
    readVersionNumber(asset, "minVersion", warnings);
    if (!asset.contains("version")) failGltf("the glTF version is missing", "/asset");
    if (!isVersion2(asset["version"], false))
        failGltf("the file is glTF " + shownJson(asset["version"]) + ", but only 2.x is read",
                 "/asset/version", "convert it to glTF 2.0");
    if (asset.contains("minVersion") && !isVersion2(asset["minVersion"], true))
        failGltf("the file needs a reader of glTF " + shownJson(asset["minVersion"]) +
                     ", but peeler reads 2.0",
                 "/asset/minVersion", "export it as glTF 2.0");
}

void checkRequiredExtensions(const json& gltf, const std::vector<std::string>& ignored) {
    const auto required = gltf.find("extensionsRequired");
    // If extensionsRequired or one of its elements has another type, the schema check reports it.
    if (required == gltf.end() || !required->is_array()) return;
    for (std::size_t i = 0; i < required->size(); ++i) {
        if (!(*required)[i].is_string()) continue;
        const std::string& name = (*required)[i].get_ref<const std::string&>();
        if (std::ranges::find(ignored, name) != ignored.end()) continue;
        const std::vector<GltfExtension>& known = supportedGltfExtensions();
        if (std::none_of(known.begin(), known.end(),
                         [&](const GltfExtension& extension) { return name == extension.name; }))
            failGltf("the file requires the glTF extension " + name + ", which is not supported",
                     childPointer("/extensionsRequired", i),
                     "export it without this extension, or go on without it: " +
                         Parameter::kIgnoredExtensions + " " + name);
    }
}

}  // namespace peeler
