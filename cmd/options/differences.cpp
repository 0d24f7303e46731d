// SPDX-License-Identifier: Apache-2.0
// The table of settings, and the formatting of their values.
#include "cmd/options/differences.h"

#include <cctype>
#include <cmath>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>
#include <string_view>

#include "core/lens/picture_rays.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

using Value = nlohmann::json;

std::string plainText(const Value& value) {
    if (value.is_string()) return value.get<std::string>();
    if (value.is_boolean()) return value.get<bool>() ? "on" : "off";
    return dumpJson(value);
}

/// Returns a value as on the command line: lists are separated by commas.
std::string listText(const Value& value) {
    if (!value.is_array()) return plainText(value);
    std::string text;
    for (const Value& entry : value)
        text += (text.empty() ? "" : ",") + plainText(entry);
    return text;
}

std::string limitText(const Value& value) {
    return value == 0 ? "all" : plainText(value);
}

std::string firstText(const Value& value) {
    return value.is_array() && !value.empty() ? plainText(value.front()) : plainText(value);
}

/// A setting whose key differs from its option's name, or whose values need their own format.
struct Setting {
    std::string_view key;
    std::string_view option;
    std::string_view absent = "none";  ///< shown if the key is absent
    /// Formats a value; null = values are not shown.
    std::string (*text)(const Value&) = listText;
    std::string_view other = "another value";  ///< shown if the formatted values are the same
};

constexpr Setting kSettings[] = {
    {"animations", "--animation"},
    {"clip", "--clip-box, --clip-plane or --clip-mesh", "none", nullptr, "another volume"},
    {"environment", "--environment", "none", nullptr, "another file"},
    {"framesPerSecond", "--fps"},
    {"fxaa", "--fxaa", "off"},
    {"layers", "--layers", "all", limitText},
    {"method", "--method", "an exact one"},
    {"occlusionRatio", "--occlusion-ratio", "0", firstText, "of other pixels"},
    {"opaqueOnly", "--as midpoint-depth", "off"},
    {"placed", "--cameras", "none", nullptr, "other object positions"},
    {"samples", "--samples", "1"},
    {"selected", "--include, --exclude or --material", "none", nullptr,
     "other objects of the file"},
    {"shadePer", "--shade-per", "sample"},
    {"shadows", "--shadows", "off",
     [](const Value& value) { return "maps of " + plainText(value) + " texels"; }},
    {"tail", "--tail", "drop"},
    {"transmission", "--transmission", "alpha"},
};

const Setting* findSetting(const std::string& key) {
    for (const Setting& setting : kSettings)
        if (setting.key == key) return &setting;
    return nullptr;
}

/// Returns the difference in a setting. `here` or `there` is null if the key is absent.
Difference settingDifference(const std::string& key, const Value* here, const Value* there) {
    const Setting* known = findSetting(key);
    const Setting setting = known ? *known : Setting{};
    const auto text = [&](const Value* value) {
        if (!value) return std::string(setting.absent);
        return setting.text ? setting.text(*value) : std::string("given");
    };
    Difference difference{optionOfSetting(key), text(here), text(there)};
    if (difference.here != difference.there) return difference;
    return {difference.what + ", " + std::string(setting.other), "", ""};
}

std::string shortText(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

std::string placeText(const glm::dvec4& v) {
    return '(' + shortText(v.x) + ", " + shortText(v.y) + ", " + shortText(v.z) + ')';
}

std::string extentText(const Projection& projection) {
    if (!projection.perspective) return shortText(2 * projection.half_height) + " high";
    return shortText(2 * std::atan(projection.half_height) * 180 / std::numbers::pi) + " degrees";
}

}  // namespace

std::string Difference::text() const {
    if (here.empty() && there.empty()) return what;
    return what + ": " + here + ", not " + there;
}

std::string differencesText(const std::vector<Difference>& differences) {
    std::string text;
    for (const Difference& difference : differences)
        text += (text.empty() ? "" : "; ") + difference.text();
    return text;
}

nlohmann::json settingsJson(const Provenance& provenance) {
    Value json = parseJsonOrNull(provenance.settings);
    return json.is_object() ? json : Value();
}

std::string optionOfSetting(const std::string& key) {
    if (const Setting* known = findSetting(key)) return std::string(known->option);
    std::string option = "--";
    for (const char c : key) {
        if (std::isupper(static_cast<unsigned char>(c)) != 0) option += '-';
        option += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return option;
}

std::vector<Difference> sceneDifferences(const Provenance& here, const Provenance& there) {
    if (here.scene_hash == there.scene_hash) return {};
    if (here.scene != there.scene) return {{"the scene", here.scene, there.scene}};
    const std::string scene = here.scene.empty() ? "the scene" : "the scene " + here.scene;
    return {{scene + ", which has changed since", "", ""}};
}

std::vector<Difference> settingsDifferences(const Provenance& here, const Provenance& there) {
    if (here.settings_hash == there.settings_hash) return {};
    std::vector<Difference> found;
    const Value a = settingsJson(here), b = settingsJson(there);
    if (!a.is_null() && !b.is_null()) {
        std::set<std::string> keys;
        for (const Value& json : {std::cref(a), std::cref(b)})
            for (const auto& [key, value] : json.items())
                keys.insert(key);
        for (const std::string& key : keys) {
            const Value* in_a = a.contains(key) ? &a.at(key) : nullptr;
            const Value* in_b = b.contains(key) ? &b.at(key) : nullptr;
            if (in_a && in_b && *in_a == *in_b) continue;
            found.push_back(settingDifference(key, in_a, in_b));
        }
    }
    if (!found.empty()) return found;
    std::string by = "peeler " + here.version;
    if (there.version != here.version) by += " and " + there.version;
    return {{"other settings, which " + by + " did not record", "", ""}};
}

std::vector<Difference> sizeDifferences(const View& here, const View& there) {
    if (here.width == there.width && here.height == there.height) return {};
    const auto size = [](const View& view) {
        return std::to_string(view.width) + " x " + std::to_string(view.height);
    };
    return {{"the size of the picture", size(here), size(there)}};
}

std::vector<Difference> cameraDifferences(const View& here, const View& there) {
    std::vector<Difference> found;
    const auto add = [&](const char* what, bool same, std::string a, std::string b) {
        if (same) return;
        // The values differ only in digits that are not shown.
        if (a == b) a = b = "";
        found.push_back({what, std::move(a), std::move(b)});
    };
    if (here.known != there.known) {
        add("the camera", false, here.known ? "known" : "unknown",
            there.known ? "known" : "unknown");
    }
    if (!here.known || !there.known) return found;
    const auto name = [](const View& view) {
        return view.camera_name.empty() ? std::string("unnamed") : view.camera_name;
    };
    add("the camera", here.camera_name == there.camera_name, name(here), name(there));
    const Projection &a = here.projection, &b = there.projection;
    const auto kind = [](const Projection& p) {
        return std::string(p.perspective ? "perspective" : "orthographic");
    };
    add("the projection", a.perspective == b.perspective, kind(a), kind(b));
    const bool same_field = a.half_width == b.half_width && a.half_height == b.half_height;
    add("the field of view", here.rays || there.rays || same_field, extentText(a), extentText(b));
    const auto lens = [](const View& view) {
        return view.rays ? view.rays->text() : std::string("none");
    };
    add("the lens", lens(here) == lens(there), lens(here), lens(there));
    add("the near plane", a.near == b.near, shortText(a.near), shortText(b.near));
    add("the far plane", a.far == b.far, shortText(a.far), shortText(b.far));
    const glm::dmat4 &m = here.camera_to_world, &n = there.camera_to_world;
    add("the camera's position", m[3] == n[3], placeText(m[3]), placeText(n[3]));
    add("the camera's direction", m[0] == n[0] && m[1] == n[1] && m[2] == n[2], placeText(-m[2]),
        placeText(-n[2]));
    return found;
}

}  // namespace peeler::cmd
