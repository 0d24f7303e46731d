// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/ray_map_options.h"

#include <fnmatch.h>

#include <algorithm>
#include <numbers>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/scene_options.h"

namespace peeler::cmd {

namespace {

void takeMaps(const std::string& text, std::vector<RayMap>& maps) {
    std::vector<std::string_view> names;
    for (const RayMapInfo& map : rayMapTable())
        names.push_back(map.name);
    for (const std::string_view name : listedNames("map", text, names)) {
        const RayMap map = std::ranges::find(rayMapTable(), name, &RayMapInfo::name)->map;
        if (std::ranges::find(maps, map) == maps.end()) maps.push_back(map);
    }
}

std::pair<std::string, double> parseAttenuation(const std::string& text) {
    const std::size_t equals = text.rfind('=');
    if (equals == std::string::npos || equals == 0)
        throw Error(ErrorKind::kUsage, "expected MATERIAL=MU");
    const double mu = parseNumber(text.substr(equals + 1));
    if (mu < 0) throw Error(ErrorKind::kUsage, "expected an attenuation of 0 or more");
    return {text.substr(0, equals), mu};
}

std::pair<double, double> parseRange(const std::string& text) {
    const auto numbers = parseNumbers<2>(text, "low,high");
    if (!(numbers[0] < numbers[1]))
        throw Error(ErrorKind::kUsage, "expected low,high with low below high");
    return {numbers[0], numbers[1]};
}

std::string materialName(const Scene& scene, std::size_t material) {
    const std::string& name = scene.materials[material].name;
    return name.empty() ? "material " + std::to_string(material) : name;
}

/// Sets the attenuation of all materials with this index or a name that matches the glob. Throws
/// Error (kUsage) if no material matches.
void setAttenuation(const Scene& scene, const std::string& glob, double mu,
                    std::vector<double>& attenuation) {
    std::vector<std::string> names;
    bool found = false;
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        names.push_back(materialName(scene, i));
        if (fnmatch(glob.c_str(), names.back().c_str(), 0) != 0 && glob != std::to_string(i))
            continue;
        attenuation[i] = mu;
        found = true;
    }
    if (found) return;
    throw Error(
        ErrorKind::kUsage, "no material has a matching name", "--attenuation " + glob,
        choiceHint(glob, "materials", std::vector<std::string_view>(names.begin(), names.end())));
}

}  // namespace

void addRayMapOptions(VerbOptions& verb, RayMapFlags& flags) {
    constexpr const char* kGroup = "Inside";
    const std::string help =
        "maps to write instead of hits, with one value per ray, separated by commas; a picture "
        "shows only one map; #### in its name becomes the bundle's number:";
    verb.addRepeated(
            "--map", "NAMES", [&flags](const std::string& text) { takeMaps(text, flags.maps); },
            help)
        .someOf(describeChoices(rayMapTable()))
        .group(kGroup);
    verb.addRepeated(
            "--attenuation", "MATERIAL=MU",
            [&flags](const std::string& text) {
                flags.attenuation.push_back(parseAttenuation(text));
            },
            "attenuation coefficient of X-rays per scene unit, for the materials with this name, "
            "glob or index; a ray transmits exp(-sum of MU * length); may be repeated, the last "
            "match wins (default for transmission: the same value for all materials, such that "
            "the median path transmits half)")
        .group(kGroup);
    verb.addRepeated(
            "--part", "GLOB", [&flags](const std::string& text) { flags.parts.push_back(text); },
            "one of the two parts for --map overlap: the nodes with this name and their "
            "descendants; give it twice")
        .group(kGroup);
    addValue(verb, "--range", "LOW,HIGH", flags.range, parseRange,
             "values shown as black and yellow in a picture (default: 0 to the largest value; for "
             "first and last, the smallest to the largest); for transmission, LOW is white and "
             "HIGH black, as on X-ray film (default: 0 to 1)")
        .group(kGroup);
    verb.addFlag("--legend,!--no-legend", flags.legend,
                 "draw a colour bar with numbers and their unit below a picture (default)")
        .group(kGroup);
}

void checkRayMapFlags(const RayMapFlags& flags) {
    const auto has = [&](RayMap map) {
        return std::ranges::find(flags.maps, map) != flags.maps.end();
    };
    const bool lengths = has(RayMap::kPathLength) || has(RayMap::kTransmission);
    if (!flags.attenuation.empty() && !lengths)
        throw Error(ErrorKind::kUsage, "no map shows the attenuation", "--attenuation",
                    "add --map path-length or --map transmission");
    if (has(RayMap::kOverlap) != (flags.parts.size() == 2) || flags.parts.size() > 2)
        throw Error(ErrorKind::kUsage, "an overlap needs two parts", "--part",
                    "give --map overlap and --part twice");
    if (flags.range && flags.maps.empty())
        throw Error(ErrorKind::kUsage, "a range applies to maps only", "--range", "add --map");
    if (!flags.legend && flags.maps.empty())
        throw Error(ErrorKind::kUsage, "a legend applies to maps only", "--no-legend", "add --map");
}

bool needsAttenuation(const RayMapFlags& flags) {
    return flags.attenuation.empty() &&
           std::ranges::find(flags.maps, RayMap::kTransmission) != flags.maps.end();
}

double startAttenuation(double path) {
    return std::numbers::ln2 / path;
}

RayMapOptions rayMapOptions(const RayMapFlags& flags, const Scene& scene) {
    RayMapOptions options;
    options.range = flags.range;
    options.legend = flags.legend;
    options.settings.maps = flags.maps;
    if (!flags.attenuation.empty()) options.settings.attenuation.resize(scene.materials.size());
    for (const auto& [glob, mu] : flags.attenuation)
        setAttenuation(scene, glob, mu, options.settings.attenuation);
    for (std::size_t i = 0; i < flags.parts.size(); ++i)
        options.settings.parts[i] = nodesMatching(scene, {flags.parts[i]}, "--part");
    return options;
}

}  // namespace peeler::cmd
