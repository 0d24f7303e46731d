// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/clip_options.h"

#include <algorithm>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

namespace {

constexpr Choice<bool> kSides[] = {
    {"inside", true, "inside the clip volume"},
    {"outside", false, "outside the clip volume"},
};

void checkRoom(const ClipVolume& volume, std::size_t more) {
    if (volume.half_spaces.size() + more > ClipVolume::kMaxHalfSpaces) {
        throw Error(ErrorKind::kUsage,
                    "a clip volume has at most " + std::to_string(ClipVolume::kMaxHalfSpaces) +
                        " planes; a box has six",
                    "", "use --clip-mesh for more complex volumes");
    }
}

void addBox(ClipVolume& volume, const std::string& text) {
    const auto v = parseNumbers<6>(text, "x,y,z,x,y,z");
    checkRoom(volume, 6);
    volume.addBox({v[0], v[1], v[2]}, {v[3], v[4], v[5]});
}

void addPlane(ClipVolume& volume, const std::string& text) {
    const auto v = parseNumbers<4>(text, "a,b,c,d");
    const glm::dvec3 normal(v[0], v[1], v[2]);
    const double length = glm::length(normal);
    if (!(length > 0)) throw Error(ErrorKind::kUsage, "the plane's normal is zero");
    checkRoom(volume, 1);
    volume.half_spaces.push_back({normal / length, -v[3] / length});
}

bool hasTriangles(const Scene& scene, int mesh) {
    const auto& primitives = scene.meshes[static_cast<std::size_t>(mesh)].primitives;
    return std::any_of(primitives.begin(), primitives.end(), [](const Primitive& primitive) {
        return primitive.topology >= Topology::kTriangles;
    });
}

int chooseNode(const Scene& scene, const std::string& text) {
    std::vector<std::vector<std::string>> names;
    std::vector<std::string_view> listed;
    for (const Node& node : scene.nodes) {
        names.push_back({node.name});
        if (!node.name.empty()) listed.push_back(node.name);
    }
    if (const auto found = findNameOrIndex(text, names)) return static_cast<int>(*found);
    throw Error(ErrorKind::kUsage, "unknown node", "--clip-mesh " + text,
                choiceHint(text, "nodes", listed) + "; or give an index from 0 to " +
                    std::to_string(scene.nodes.size() - 1));
}

void collect(const Scene& scene, int node, std::vector<int>& below) {
    std::vector<int> open = {node};
    while (!open.empty()) {
        const int next = open.back();
        open.pop_back();
        below.push_back(next);
        const auto& children = scene.nodes[static_cast<std::size_t>(next)].children;
        open.insert(open.end(), children.begin(), children.end());
    }
}

}  // namespace

void addClipOptions(VerbOptions& verb, ClipOptions& options) {
    constexpr const char* kGroup = "Clipping";
    verb.addRepeated(
            "--clip-box", "X,Y,Z,X,Y,Z",
            [&](const std::string& text) { addBox(options.volume, text); },
            "two opposite corners of a box in world space; several clip volumes are intersected")
        .group(kGroup);
    verb.addRepeated(
            "--clip-plane", "A,B,C,D",
            [&](const std::string& text) { addPlane(options.volume, text); },
            "the half-space ax + by + cz + d >= 0")
        .group(kGroup);
    verb.addRepeated(
            "--clip-mesh", "NODE", [&](const std::string& text) { options.meshes.push_back(text); },
            "closed mesh of a node and its descendants, by name or index; it is not drawn itself")
        .group(kGroup);
    addValue(
        verb, "--clip", "SIDE", options.volume.keep_inside,
        [&options](const std::string& text) {
            options.side_given = true;
            return choose<bool>("side", kSides, text);
        },
        "fragments to keep:")
        .oneOf(describeChoices(kSides, true))
        .group(kGroup);
}

void checkClipOptions(const ClipOptions& options) {
    if (!options.side_given || options.volume.active() || !options.meshes.empty()) return;
    throw Error(ErrorKind::kUsage, "there is no clip volume", "--clip",
                "add --clip-box, --clip-plane or --clip-mesh");
}

ClipVolume clipVolume(const ClipOptions& options, const PosedScene& posed) {
    const Scene& scene = posed.scene();
    ClipVolume volume = options.volume;
    for (const std::string& name : options.meshes) {
        std::vector<int> below;
        collect(scene, chooseNode(scene, name), below);
        const bool bounds = std::any_of(
            posed.meshes().begin(), posed.meshes().end(), [&](const MeshInstance& instance) {
                return std::find(below.begin(), below.end(), instance.node) != below.end() &&
                       hasTriangles(scene, instance.mesh);
            });
        if (!bounds) {
            throw Error(ErrorKind::kUsage, "the node shows no triangles to clip with",
                        "--clip-mesh " + name, "name a node with a closed mesh");
        }
        volume.nodes.insert(volume.nodes.end(), below.begin(), below.end());
    }
    return volume;
}

}  // namespace peeler::cmd
