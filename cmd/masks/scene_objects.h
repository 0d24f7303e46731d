// SPDX-License-Identifier: Apache-2.0
// What the objects of a scene are that masks are made of.
#pragma once

#include <string>
#include <vector>

#include "core/image/object_masks.h"
#include "core/scene/posed_scene.h"
#include "formats/masks/mask_folder.h"

namespace peeler::cmd {

class VerbOptions;

enum class ObjectsBy { kNode, kMaterial, kGlob, kExtras };

/// --by.
struct ObjectsRequest {
    ObjectsBy by = ObjectsBy::kNode;
    std::vector<std::string> globs{};  ///< of kGlob: each is an object
    std::string key{};                 ///< of kExtras
    bool given = false;

    /// As on the command line: "node", "glob:a,b", "extras:class".
    std::string text() const;
};

/// Declares --by; `request` must outlive the parse.
void addObjectsOption(VerbOptions& verb, ObjectsRequest& request);

/// The objects of a scene, and which fragments are theirs.
struct SceneObjects {
    std::vector<MaskedObject> objects;
    ObjectTable table;
};

/// Finds them among what is shown. Throws Error (kUsage) for a glob that no node matches, and for a
/// key that no node has.
SceneObjects objectsOf(const PosedScene& posed, const ObjectsRequest& request);

/// Where the objects are in a pose: the matrix of what is one mesh in one place; anything else is
/// the world's own, as it stands there.
std::vector<glm::dmat4> placesOf(const PosedScene& posed, const SceneObjects& objects);

}  // namespace peeler::cmd
