// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/scene_options.h"

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

void addSceneOptions(VerbOptions& verb, SceneOptions& options) {
    constexpr const char* kGroup = "Scene";
    addValue(
        verb, "--scene", "NAME|INDEX", options.scene, [](const std::string& text) { return text; },
        "which of the file's scenes (default: its own choice)")
        .group(kGroup);
    verb.addRepeated(
            "--include", "GLOB", [&](const std::string& text) { options.include.push_back(text); },
            "show only the meshes of nodes with such a name, and of those below them; *, ? and "
            "[a-z] as in a shell; may be repeated")
        .group(kGroup);
    verb.addRepeated(
            "--exclude", "GLOB", [&](const std::string& text) { options.exclude.push_back(text); },
            "leave out nodes with such a name and all below them, lights included; may be repeated")
        .group(kGroup);
    addSandboxOption(verb, options.reading.allow_outside);
    addStrictOption(verb, options.reading.strict);
    verb.addRepeated(
            "--ignore-extension", "NAME",
            [&](const std::string& text) { options.reading.ignored_extensions.push_back(text); },
            "go on without a glTF extension that the file requires and peeler lacks; textures "
            "that only it has an image for are left out; may be repeated")
        .group(kGroup);
    addValue(
        verb, "--smooth-normals", "DEGREES", options.reading.smooth_normals,
        [](const std::string& text) { return parseNumber(text); },
        "of a PLY, STL or OBJ without normals: surfaces are smooth across edges that turn by so "
        "much at most, 0 to 180 (default: every triangle is flat)")
        .group(kGroup);
    if (!verb.knows("--unit")) addUnitOption(verb, options.reading);
}

double parseLengthUnit(const std::string& text) {
    const bool is_number = text.find_first_of("0123456789") != std::string::npos;
    return is_number ? parsePositive(text) : choose<double>("unit", kLengthUnits, text);
}

void addUnitOption(VerbOptions& verb, SceneReadOptions& reading) {
    addValue(verb, "--unit", "NAME|METRES", reading.metres_per_unit, parseLengthUnit,
             "what a unit of a PLY, STL or OBJ is, by name or in metres; the scene has metres then "
             "(default: numbers stay as they are):")
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
                 "read the buffers and images of the scene wherever it says: without this, nothing "
                 "outside its folder (absolute paths, \"..\", symbolic links)")
        .group("Scene");
}

void addStrictOption(VerbOptions& verb, bool& strict) {
    verb.addFlag("--strict", strict,
                 "a warning about what an input says and is not shown is an error (exit code 3); "
                 "nothing is written then")
        .group("Messages");
}

void addNormalizeOption(VerbOptions& verb, SceneOptions& options) {
    addValue(
        verb, "--normalize", "NAME", options.normalize,
        [](const std::string& text) {
            return choose<Normalized>("size of a scene", kNormalized, text);
        },
        "move the middle of what is shown, as it is at rest, to the origin, and scale it alike in "
        "all directions:")
        .oneOf(describeChoices(kNormalized))
        .group("Scene");
}

}  // namespace peeler::cmd
