// SPDX-License-Identifier: Apache-2.0
// Objects of a scene for masks.
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
    std::vector<std::string> globs{};  ///< for kGlob: one object each
    std::string key{};                 ///< for kExtras
    bool given = false;

    /// Returns the command-line form: "node", "glob:a,b", "extras:class".
    std::string text() const;
};

/// Declares --by; `request` must outlive the parse.
void addObjectsOption(VerbOptions& verb, ObjectsRequest& request);

/// The objects of a scene, and the table that assigns fragments to them.
struct SceneObjects {
    std::vector<MaskedObject> objects;
    ObjectTable table;
};

/// Finds the objects in the shown scene. Throws Error (kUsage) if no node matches a glob or has the
/// key.
SceneObjects objectsOf(const PosedScene& posed, const ObjectsRequest& request);

/// Returns the objects' transforms in a pose: the matrix of an object that is one mesh at one
/// place, the identity for any other.
std::vector<glm::dmat4> placesOf(const PosedScene& posed, const SceneObjects& objects);

}  // namespace peeler::cmd
