// SPDX-License-Identifier: Apache-2.0
// The options of the group Scene: which file, which of its scenes and nodes, and how it is read.
#pragma once

#include "cmd/session/scene_request.h"

namespace peeler::cmd {

class VerbOptions;

/// Declares --scene, --include, --exclude, --allow-outside, --strict, --ignore-extension,
/// --smooth-normals and, unless the verb has one of its own, --unit. `options` must outlive the
/// parse.
void addSceneOptions(VerbOptions& verb, SceneOptions& options);
/// Declares --up of verbs that have no camera, whose --up takes axes, too (addCameraOptions()).
void addUpOption(VerbOptions& verb, SceneReadOptions& reading);
/// Declares --unit.
void addUnitOption(VerbOptions& verb, SceneReadOptions& reading);
inline constexpr const char* kUpHelp =
    "x, y or z: of a PLY, STL or OBJ, the axis that points up, as +Y does in the scene "
    "(default: y)";
/// Declares --allow-outside alone.
void addSandboxOption(VerbOptions& verb, bool& allow_outside);
/// Declares --strict: warnings about what is read become errors.
void addStrictOption(VerbOptions& verb, bool& strict);
/// Declares --normalize.
void addNormalizeOption(VerbOptions& verb, SceneOptions& options);

/// Lengths of a unit in metres.
inline constexpr Choice<double> kLengthUnits[] = {
    {"m", 1, "metres, as glTF has it"}, {"mm", 1e-3, "millimetres, as some exporters leave them"},
    {"cm", 1e-2, "centimetres"},        {"inch", 0.0254, "inches"},
    {"in", 0.0254, "inches"},
};

/// The length of a unit in metres: one of these names, or a number of metres.
double parseLengthUnit(const std::string& text);

}  // namespace peeler::cmd
