// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/scene_options.h"

#include <algorithm>
#include <iterator>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

void addSceneOptions(VerbOptions& verb, SceneOptions& options) {
    constexpr const char* kGroup = "Scene";
    addValue(
        verb, "--scene", "NAME|INDEX", options.scene, [](const std::string& text) { return text; },
        "scene of the file to use (default: the file's default scene)")
        .group(kGroup);
    verb.addRepeated(
            "--include", "GLOB", [&](const std::string& text) { options.include.push_back(text); },
            "show only meshes of nodes with a matching name and of their descendants; *, ? and "
            "[a-z] as in a shell; may be repeated")
        .group(kGroup);
    verb.addRepeated(
            "--exclude", "GLOB", [&](const std::string& text) { options.exclude.push_back(text); },
            "leave out nodes with a matching name and their descendants, including lights; may be "
            "repeated")
        .group(kGroup);
    addSandboxOption(verb, options.reading.allow_outside);
    addStrictOption(verb, options.reading.strict);
    verb.addRepeated(
            "--ignore-extension", "NAME",
            [&](const std::string& text) { options.reading.ignored_extensions.push_back(text); },
            "read a file that requires this glTF extension, although peeler does not support it; "
            "textures whose only image needs the extension are left out; may be repeated")
        .group(kGroup);
    addValue(
        verb, "--smooth-normals", "DEGREES", options.reading.smooth_normals,
        [](const std::string& text) { return parseNumber(text); },
        "smooth edges up to this angle, 0 to 180, in a PLY, STL, OBJ or 3MF without normals "
        "(default: "
        "flat triangles)")
        .group(kGroup);
    if (!verb.knows("--unit")) addUnitOption(verb, options.reading);
}

std::string_view lengthUnitName(double metres) {
    const auto* const unit = std::ranges::find(kLengthUnits, metres, &Choice<double>::value);
    return unit == std::end(kLengthUnits) ? std::string_view() : unit->name;
}

double parseLengthUnit(const std::string& text) {
    const bool is_number = text.find_first_of("0123456789") != std::string::npos;
    return is_number ? parsePositive(text) : choose<double>("unit", kLengthUnits, text);
}

void addUnitOption(VerbOptions& verb, SceneReadOptions& reading) {
    addValue(verb, "--unit", "NAME|METRES", reading.metres_per_unit, parseLengthUnit,
             "length unit of a PLY, STL, OBJ, SPZ or .splat, by name or in metres; lengths are "
             "converted to "
             "metres (default: no conversion):")
        .oneOf(describeChoices(kLengthUnits))
        .group("Scene");
}

void addUpOption(VerbOptions& verb, SceneReadOptions& reading) {
    verb.addText(
            "--up", "x|y|z",
            [&](const std::string& text) {
                reading.up = axisNamed(text);
                if (!reading.up) throw Error(ErrorKind::kUsage, "expected an axis: x, y or z");
            },
            kUpHelp)
        .group("Scene");
}

void addSandboxOption(VerbOptions& verb, bool& allow_outside) {
    verb.addFlag("--allow-outside", allow_outside,
                 "allow buffers and images outside the scene's folder: absolute paths, \"..\", "
                 "symbolic links")
        .group("Scene");
}

void addStrictOption(VerbOptions& verb, bool& strict) {
    verb.addFlag("--strict", strict,
                 "turn warnings about the input into errors (exit code 3); nothing is written then")
        .group("Messages");
}

void addNormalizeOption(VerbOptions& verb, SceneOptions& options) {
    addValue(
        verb, "--normalize", "NAME", options.normalize,
        [](const std::string& text) {
            return choose<Normalized>("normalization", kNormalized, text);
        },
        "centre the visible scene at rest on the origin and scale it uniformly:")
        .oneOf(describeChoices(kNormalized))
        .group("Scene");
}

}  // namespace peeler::cmd
