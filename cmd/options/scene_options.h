// SPDX-License-Identifier: Apache-2.0
// The options under the heading Scene: scene, nodes, reading.
#pragma once

#include <string>
#include <string_view>

#include "cmd/session/scene_request.h"

namespace peeler::cmd {

class VerbOptions;

/// Declares --scene, --include, --exclude, --allow-outside, --strict, --ignore-extension,
/// --smooth-normals and --unit. Omits --unit if the verb already has an option of this name.
/// `options` must outlive the parse.
void addSceneOptions(VerbOptions& verb, SceneOptions& options);
/// Declares --up for verbs without a camera. In other verbs, addCameraOptions() declares an --up
/// that also accepts axes.
void addUpOption(VerbOptions& verb, SceneReadOptions& reading);
void addUnitOption(VerbOptions& verb, SceneReadOptions& reading);
inline constexpr const char* kUpHelp =
    "up axis of a PLY, STL, OBJ, SPZ or .splat, which becomes +Y of the scene (default: y)";
/// Declares --allow-outside, without the other scene options.
void addSandboxOption(VerbOptions& verb, bool& allow_outside);
/// Declares --strict, which turns warnings of readers into errors.
void addStrictOption(VerbOptions& verb, bool& strict);
void addNormalizeOption(VerbOptions& verb, SceneOptions& options);

/// Units of length by name, in metres.
inline constexpr Choice<double> kLengthUnits[] = {
    {"m", 1, "metres, as in glTF"}, {"mm", 1e-3, "millimetres, as some exporters write"},
    {"cm", 1e-2, "centimetres"},    {"inch", 0.0254, "inches"},
    {"in", 0.0254, "inches"},
};

/// Returns the name of the unit with this length, or "".
std::string_view lengthUnitName(double metres);
/// Returns the length of a unit in metres. The text is a name from kLengthUnits or a number.
double parseLengthUnit(const std::string& text);

}  // namespace peeler::cmd
