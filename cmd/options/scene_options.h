// SPDX-License-Identifier: Apache-2.0
// What of a scene file is shown: one of its scenes, some of its nodes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler::cmd {

class VerbOptions;

struct SceneOptions {
    std::filesystem::path file;
    std::optional<std::string> scene;           ///< name or index; none = the file's default
    std::vector<std::string> include, exclude;  ///< globs of node names
    GltfOptions gltf;
};

/// Declares --scene, --include, --exclude and --allow-outside. `options` must outlive the parse.
void addSceneOptions(VerbOptions& verb, SceneOptions& options);
/// Declares --allow-outside alone.
void addSandboxOption(VerbOptions& verb, bool& allow_outside);

/// The scene's index. Throws Error (kUsage) with the list for one that is not there.
int chooseScene(const Scene& scene, const SceneOptions& options);

/// Of every node whether it has a name that matches one of the globs, or is below one that has.
/// Throws Error (kUsage) for a glob that no node matches; `option` is where it comes from.
std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option);

/// Takes away what is not to be seen: with --include every mesh that neither is at a node of such a
/// name nor below one, with --exclude the nodes of such names and all below them, lights included.
/// Cameras stay. Throws Error (kUsage) for a glob that no node matches.
void selectNodes(Scene& scene, const SceneOptions& options);

}  // namespace peeler::cmd
