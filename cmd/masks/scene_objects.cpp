// SPDX-License-Identifier: Apache-2.0
#include "cmd/masks/scene_objects.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/options/scene_options.h"
#include "cmd/session/choices.h"
#include "core/base/names.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kGlobPrefix = "glob:", kExtrasPrefix = "extras:";

constexpr Choice<ObjectsBy> kObjectsBy[] = {
    {"node", ObjectsBy::kNode,
     "one per node with a mesh, or one per instance if the node has instances "
     "(EXT_mesh_gpu_instancing)"},
    {"material", ObjectsBy::kMaterial, "one per material"},
};
/// Values of --by other than those in kObjectsBy, for the help.
constexpr const char* kPatterns[] = {
    "glob:GLOB,...: one per glob, of the nodes with a matching name and their descendants; the "
    "first match counts; may be repeated",
    "extras:KEY: one per value of the key (a string, a number, true or false) in the extras of "
    "nodes; descendants inherit the value",
};
constexpr std::string_view kObjectNames[] = {"node", "material", "glob:GLOB,...", "extras:KEY"};

void takeGlobs(std::string_view list, ObjectsRequest& request) {
    while (true) {
        const std::size_t comma = list.find(',');
        if (comma == 0 || list.empty()) throw Error(ErrorKind::kUsage, "a glob is empty");
        request.globs.emplace_back(list.substr(0, comma));
        if (comma == std::string_view::npos) return;
        list.remove_prefix(comma + 1);
    }
}

void takeObjects(std::string_view text, ObjectsRequest& request) {
    const bool globs = text.starts_with(kGlobPrefix);
    if (request.given && !(globs && request.by == ObjectsBy::kGlob))
        throw Error(ErrorKind::kUsage, "objects can be chosen in one way only", "",
                    "give --by once; only glob: may be repeated");
    request.given = true;
    if (globs) {
        request.by = ObjectsBy::kGlob;
        return takeGlobs(text.substr(kGlobPrefix.size()), request);
    }
    if (text.starts_with(kExtrasPrefix) && text.size() > kExtrasPrefix.size()) {
        request.by = ObjectsBy::kExtras;
        request.key = text.substr(kExtrasPrefix.size());
        return;
    }
    const auto* const row = std::ranges::find(kObjectsBy, text, &Choice<ObjectsBy>::name);
    if (row == std::end(kObjectsBy)) refuseName("choice of objects", text, kObjectNames);
    request.by = row->value;
}

/// Adds an object with this number (0: the object's position). Returns the position, from 1.
std::uint32_t addObject(std::string name, SceneObjects& found, std::size_t number = 0) {
    const std::size_t position = found.objects.size() + 1;
    found.objects.push_back(
        {std::move(name), static_cast<std::uint32_t>(number == 0 ? position : number)});
    return static_cast<std::uint32_t>(position);
}

void findNodes(const PosedScene& posed, const ObjectsRequest& /*request*/, SceneObjects& found) {
    const Scene& scene = posed.scene();
    found.table.instances_apart = true;
    std::map<int, int> instances;  // number of instances so far, per node
    std::size_t last = scene.nodes.size();
    for (const MeshInstance& mesh : posed.meshes()) {
        const auto node = static_cast<std::size_t>(mesh.node);
        const int ordinal = instances[mesh.node]++;
        std::string name = nodeName(scene, node);
        if (scene.nodes[node].instances) name += " [" + std::to_string(ordinal) + ']';
        const std::uint32_t number =
            addObject(std::move(name), found, ordinal == 0 ? node + 1 : ++last);
        found.objects.back().node = mesh.node;
        if (scene.nodes[node].instances) found.objects.back().instance = ordinal;
        if (ordinal == 0) found.table.numbers[node] = number;
    }
}

void findMaterials(const PosedScene& posed, const ObjectsRequest& /*request*/,
                   SceneObjects& found) {
    const std::vector<std::string> names = idNames(posed.scene()).materials;
    std::set<int> used;
    for (const MeshInstance& mesh : posed.meshes())
        for (const Primitive& primitive : posed.primitives(mesh))
            used.insert(primitive.material);
    found.table.by_material = true;
    for (const int material : used) {
        const auto index = static_cast<std::size_t>(material);
        found.table.numbers[index] = addObject(names[index], found, index + 1);
        found.objects.back().material = material;
    }
}

void findGlobs(const PosedScene& posed, const ObjectsRequest& request, SceneObjects& found) {
    for (const std::string& glob : request.globs) {
        const std::vector<char> marked = nodesMatching(posed.scene(), {glob}, "--by glob:");
        const std::uint32_t number = addObject(glob, found);
        for (std::size_t i = 0; i < marked.size(); ++i)
            if (marked[i] && found.table.numbers[i] == 0) found.table.numbers[i] = number;
    }
}

/// Returns the value of a key in a node's extras, or null if the node lacks it.
const std::string* extraOf(const Node& node, const std::string& key) {
    for (const auto& [name, value] : node.extras)
        if (name == key) return &value;
    return nullptr;
}

[[noreturn]] void refuseKey(const Scene& scene, const std::string& key) {
    std::set<std::string_view> keys;
    for (const Node& node : scene.nodes)
        for (const auto& extra : node.extras)
            keys.insert(extra.first);
    const std::vector<std::string_view> names(keys.begin(), keys.end());
    throw Error(ErrorKind::kUsage, "no node has extras with this key", "--by extras:" + key,
                names.empty()
                    ? "no node of the scene has extras with a string, a number, true or false"
                    : choiceHint(key, "keys", names));
}

void findExtras(const PosedScene& posed, const ObjectsRequest& request, SceneObjects& found) {
    const Scene& scene = posed.scene();
    // Numbers of the objects, by the value in `extras`.
    std::map<std::string, std::uint32_t> numbers;
    struct Visit {
        int node = 0;
        std::uint32_t inherited = 0;
    };
    std::vector<Visit> ahead;  // stack for a depth-first traversal in draw order
    const std::vector<int> roots = rootsOf(scene.nodes);
    for (auto root = roots.rbegin(); root != roots.rend(); ++root)
        ahead.push_back({*root, 0});
    while (!ahead.empty()) {
        auto [index, number] = ahead.back();
        ahead.pop_back();
        const Node& node = scene.nodes[static_cast<std::size_t>(index)];
        if (const std::string* const value = extraOf(node, request.key)) {
            std::uint32_t& known = numbers[*value];
            if (known == 0) known = addObject(*value, found);
            number = known;
        }
        found.table.numbers[static_cast<std::size_t>(index)] = number;
        for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
            ahead.push_back({*child, number});
    }
    if (numbers.empty()) refuseKey(scene, request.key);
}

/// The functions that find objects, in the order of ObjectsBy.
constexpr void (*kFind[])(const PosedScene&, const ObjectsRequest&, SceneObjects&) = {
    findNodes, findMaterials, findGlobs, findExtras};

}  // namespace

std::string ObjectsRequest::text() const {
    if (by == ObjectsBy::kExtras) return std::string(kExtrasPrefix) + key;
    if (by != ObjectsBy::kGlob) return by == ObjectsBy::kNode ? "node" : "material";
    std::string text(kGlobPrefix);
    for (std::size_t i = 0; i < globs.size(); ++i)
        text += (i == 0 ? "" : ",") + globs[i];
    return text;
}

void addObjectsOption(VerbOptions& verb, ObjectsRequest& request) {
    auto choices = describeChoices(kObjectsBy, true);
    for (const char* pattern : kPatterns)
        choices.push_back({"", pattern});
    verb.addRepeated(
            "--by", "NAME", [&request](const std::string& text) { takeObjects(text, request); },
            "objects of the scene; all other surfaces are background, which still occludes:")
        .group("Objects")
        .oneOf(std::move(choices));
}

SceneObjects objectsOf(const PosedScene& posed, const ObjectsRequest& request) {
    const Scene& scene = posed.scene();
    SceneObjects found;
    found.table.numbers.assign(
        request.by == ObjectsBy::kMaterial ? scene.materials.size() : scene.nodes.size(), 0);
    kFind[static_cast<std::size_t>(request.by)](posed, request, found);
    found.table.objects = static_cast<std::uint32_t>(found.objects.size());
    return found;
}

std::vector<glm::dmat4> placesOf(const PosedScene& posed, const SceneObjects& objects) {
    const ObjectTable& table = objects.table;
    std::vector<glm::dmat4> places(table.objects, glm::dmat4(1));
    std::vector<std::size_t> meshes(table.objects, 0);
    const auto take = [&](std::uint32_t number, const MeshInstance& mesh) {
        if (number == 0) return;
        const bool alone = ++meshes[number - 1] == 1;
        places[number - 1] = alone ? mesh.world : glm::dmat4(1);
    };
    std::map<int, std::uint32_t> instances;  // number of instances so far, per node
    for (const MeshInstance& mesh : posed.meshes()) {
        const std::uint32_t ordinal = instances[mesh.node]++;
        if (!table.by_material) {
            const std::uint32_t first = table.numbers[static_cast<std::size_t>(mesh.node)];
            take(first != 0 && table.instances_apart ? first + ordinal : first, mesh);
            continue;
        }
        std::set<int> materials;
        for (const Primitive& primitive : posed.primitives(mesh))
            materials.insert(primitive.material);
        for (const int material : materials)
            take(table.numbers[static_cast<std::size_t>(material)], mesh);
    }
    return places;
}

}  // namespace peeler::cmd
