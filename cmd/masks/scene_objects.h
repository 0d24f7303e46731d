// SPDX-License-Identifier: Apache-2.0
// The objects of a scene, for masks.
#pragma once

#include <string>
#include <vector>

#include "core/image/object_masks.h"
#include "core/scene/posed_scene.h"
#include "formats/masks/mask_folder.h"

namespace peeler::cmd {

class VerbOptions;

enum class ObjectsBy { kNode, kMaterial, kGlob, kExtras };

/// The objects requested by --by.
struct ObjectsRequest {
    ObjectsBy by = ObjectsBy::kNode;
    std::vector<std::string> globs{};  ///< globs for kGlob; each glob defines one object
    std::string key{};                 ///< key in `extras`, for kExtras
    bool given = false;

    /// Returns the request as on the command line: "node", "glob:a,b", "extras:class".
    std::string text() const;
};

/// Declares --by; `request` must outlive the parse.
void addObjectsOption(VerbOptions& verb, ObjectsRequest& request);

/// The objects of a scene, and the table that assigns fragments to them.
struct SceneObjects {
    std::vector<MaskedObject> objects;
    ObjectTable table;
};

/// Finds the objects in the visible scene (formats/README.md, "Numbers of objects"). Throws Error
/// (kUsage) if no node matches a glob or has the key.
SceneObjects objectsOf(const PosedScene& posed, const ObjectsRequest& request);

/// Returns the objects' transforms in a pose: the mesh's matrix for an object that consists of a
/// single mesh instance, the identity for others.
std::vector<glm::dmat4> placesOf(const PosedScene& posed, const SceneObjects& objects);

}  // namespace peeler::cmd
