// SPDX-License-Identifier: Apache-2.0
// Checker of JSON against the schema table.
#include "formats/gltf/gltf_schema.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include <peeler/error.h>
#include "formats/file/json_text.h"

namespace peeler {
namespace {

using nlohmann::json;

/// Returns the table's rows with this owner.
const std::vector<const SchemaRow*>& schemaRowsOf(std::string_view owner) {
    static const auto rows = [] {
        std::map<std::string_view, std::vector<const SchemaRow*>> result;
        for (const SchemaRow& property : schemaRows())
            result[property.owner].push_back(&property);
        return result;
    }();
    static const std::vector<const SchemaRow*> none;
    const auto found = rows.find(owner);
    return found == rows.end() ? none : found->second;
}

bool listed(std::string_view list, std::string_view word) {
    while (!list.empty()) {
        const std::size_t end = std::min(list.find(' '), list.size());
        if (list.substr(0, end) == word) return true;
        list.remove_prefix(std::min(end + 1, list.size()));
    }
    return false;
}

class SchemaCheck {
  public:
    explicit SchemaCheck(json& root) : root_(root) {}

    // The depth of the recursion is limited by the nesting of the table, not of the file.
    void object(json& value, const std::string& pointer, std::string_view owner) {
        if (!value.is_object()) refuse(pointer, "must be an object", value);
        for (const SchemaRow* property : schemaRowsOf(owner)) {
            const auto found = value.find(property->name);
            if (found != value.end()) {
                member(*found, childPointer(pointer, property->name), *property);
            } else if (property->required) {
                failGltf("the required property \"" + std::string(property->name) + "\" is missing",
                         pointer);
            }
        }
    }

  private:
    [[noreturn]] static void refuse(const std::string& pointer, const std::string& rule,
                                    const json& value) {
        failGltf("the value " + rule + ", but is " + shownJson(value), pointer);
    }

    void member(json& value, const std::string& pointer, const SchemaRow& rule) {
        switch (rule.kind) {
            case SchemaKind::kBool:
                if (!value.is_boolean()) refuse(pointer, "must be true or false", value);
                break;
            case SchemaKind::kString:
                string(value, pointer, rule);
                break;
            case SchemaKind::kNumber:
                number(value, pointer);
                break;
            case SchemaKind::kPositive:
                number(value, pointer);
                if (value.get<double>() <= 0) refuse(pointer, "must be above zero", value);
                break;
            case SchemaKind::kInteger:
                integer(value, pointer, rule.min, rule.max);
                break;
            case SchemaKind::kEnum:
                integer(value, pointer, 0, kIntMax);
                if (!listed(rule.of, dumpJson(value)))
                    refuse(pointer, "must be one of " + std::string(rule.of), value);
                break;
            case SchemaKind::kIndex:
                index(value, pointer, rule.of);
                break;
            case SchemaKind::kIndexMap:
                indexMap(value, pointer, rule.of);
                break;
            case SchemaKind::kIntegerMap:
                integerMap(value, pointer, rule);
                break;
            case SchemaKind::kObject:
                object(value, pointer, rule.of);
                break;
            case SchemaKind::kExtensions:
                extensions(value, pointer, rule.owner);
                break;
            case SchemaKind::kStrings:
            case SchemaKind::kNumbers:
            case SchemaKind::kNumberList:
            case SchemaKind::kIndices:
            case SchemaKind::kIndexMaps:
            case SchemaKind::kObjects:
                array(value, pointer, rule);
                break;
        }
    }

    void array(json& value, const std::string& pointer, const SchemaRow& rule) {
        if (!value.is_array()) refuse(pointer, "must be an array", value);
        if (rule.kind == SchemaKind::kNumbers && static_cast<double>(value.size()) != rule.max)
            refuse(pointer, "must have " + std::to_string(static_cast<int>(rule.max)) + " elements",
                   value);
        for (std::size_t i = 0; i < value.size(); ++i) {
            const std::string element = childPointer(pointer, i);
            switch (rule.kind) {
                case SchemaKind::kStrings:
                    if (!value[i].is_string()) refuse(element, "must be a string", value[i]);
                    break;
                case SchemaKind::kNumbers:
                case SchemaKind::kNumberList:
                    number(value[i], element);
                    break;
                case SchemaKind::kIndices:
                    index(value[i], element, rule.of);
                    break;
                case SchemaKind::kIndexMaps:
                    indexMap(value[i], element, rule.of);
                    break;
                default:
                    object(value[i], element, rule.of);
                    break;
            }
        }
    }

    static void string(const json& value, const std::string& pointer, const SchemaRow& rule) {
        if (!value.is_string()) refuse(pointer, "must be a string", value);
        if (*rule.of && !listed(rule.of, value.get_ref<const std::string&>()))
            refuse(pointer, "must be one of " + std::string(rule.of), value);
    }

    static void number(json& value, const std::string& pointer) {
        if (!value.is_number()) refuse(pointer, "must be a number", value);
        const double number = value.get<double>();
        if (!(std::fabs(number) <= std::numeric_limits<float>::max()))
            refuse(pointer, "must fit a 32-bit float", value);
        // tinygltf would truncate large integers to int, so convert them to floating point.
        if (value.is_number_integer() && std::fabs(number) > kIntMax) value = number;
    }

    static void integer(json& value, const std::string& pointer, double min, double max) {
        const bool number = value.is_number();
        const double wanted = number ? value.get<double>() : 0;
        if (!number || wanted != std::floor(wanted) || wanted < min || wanted > max)
            refuse(pointer,
                   "must be an integer " +
                       (max < kAnySize
                            ? "from " + std::to_string(static_cast<std::int64_t>(min)) + " to " +
                                  std::to_string(static_cast<std::int64_t>(max))
                            : "of at least " + std::to_string(static_cast<std::int64_t>(min))),
                   value);
        if (value.is_number_float()) value = static_cast<std::uint64_t>(wanted);
    }

    /// Returns the size of an array in the root object. "extensions/NAME/arrays" means an array in
    /// an extension.
    std::size_t sizeOf(std::string_view array_name) {
        const auto [known, is_new] = sizes_.try_emplace(array_name, 0);
        if (!is_new) return known->second;
        const json::json_pointer place('/' + std::string(array_name));
        if (root_.contains(place) && root_[place].is_array())
            known->second = std::min<std::size_t>(root_[place].size(), 1U << 31U);
        return known->second;
    }

    void index(json& value, const std::string& pointer, const char* array_name) {
        const std::size_t size = sizeOf(array_name);
        integer(value, pointer, 0, kIntMax);
        if (value.get<std::size_t>() >= size)
            refuse(pointer,
                   "must be an index into \"" + std::string(array_name) + "\", which has " +
                       std::to_string(size) + (size == 1 ? " element" : " elements"),
                   value);
    }

    void indexMap(json& value, const std::string& pointer, const char* array_name) {
        if (!value.is_object()) refuse(pointer, "must be an object", value);
        for (const auto& [key, element] : value.items())
            index(element, childPointer(pointer, key), array_name);
    }

    static void integerMap(json& value, const std::string& pointer, const SchemaRow& rule) {
        if (!value.is_object()) refuse(pointer, "must be an object", value);
        for (const auto& [key, element] : value.items())
            integer(element, childPointer(pointer, key), rule.min, rule.max);
    }

    void extensions(json& value, const std::string& pointer, const std::string& owner) {
        if (!value.is_object()) refuse(pointer, "must be an object", value);
        for (const auto& [name, element] : value.items()) {
            const std::string child = childPointer(pointer, name);
            const std::string key =
                name == "KHR_meshopt_compression" ? "EXT_meshopt_compression" : name;
            if (!schemaRowsOf(key).empty()) object(element, child, key);
            if (const std::string here = childPointer(owner, key); !schemaRowsOf(here).empty())
                object(element, child, here);
        }
    }

    json& root_;
    /// Sizes of the root object's arrays, cached because there may be millions of indices.
    std::map<std::string_view, std::size_t> sizes_;
};

/// Checks that strides are multiples of 4 (§5.11).
void checkStrides(const json& views) {
    for (std::size_t i = 0; i < views.size(); ++i)
        if (const int stride = views[i].value("byteStride", 4); stride % 4 != 0)
            failGltf("the value must be a multiple of 4, but is " + std::to_string(stride),
                     childPointer("/bufferViews", i) + "/byteStride");
}

/// Checks that channels refer to samplers of their own animation (§5.5).
void checkAnimationSamplers(const json& animations) {
    for (std::size_t i = 0; i < animations.size(); ++i) {
        const std::size_t samplers = animations[i]["samplers"].size();
        const json& channels = animations[i]["channels"];
        for (std::size_t j = 0; j < channels.size(); ++j)
            if (channels[j]["sampler"].get<std::size_t>() >= samplers)
                failGltf(
                    "the value must be an index into the animation's " + std::to_string(samplers) +
                        " samplers",
                    childPointer(childPointer("/animations", i) + "/channels", j) + "/sampler");
    }
}

/// Checks that sparse accessors do not replace more elements than the accessor has (§5.2).
void checkSparseCounts(const json& accessors) {
    for (std::size_t i = 0; i < accessors.size(); ++i)
        if (const auto sparse = accessors[i].find("sparse"); sparse != accessors[i].end())
            if ((*sparse)["count"].get<std::uint64_t>() >
                accessors[i]["count"].get<std::uint64_t>())
                failGltf("more elements are substituted than the accessor has",
                         childPointer("/accessors", i) + "/sparse/count");
}

/// Checks that cameras have the object for their type (§3.10).
void checkCameraKinds(const json& cameras) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const json& camera = cameras[i];
        const std::string& type = camera["type"].get_ref<const std::string&>();
        if (!camera.contains(type))
            failGltf("the required property \"" + type + "\" is missing",
                     childPointer("/cameras", i));
    }
}

}  // namespace

void failGltf(const Text& what, const Text& where, const Text& hint) {
    throw Error(ErrorKind::kInput, what, where, hint);
}

void checkGltfSchema(json& gltf) {
    SchemaCheck(gltf).object(gltf, "", "root");
    // Rules that the table cannot express.
    if (const auto views = gltf.find("bufferViews"); views != gltf.end()) checkStrides(*views);
    if (const auto accessors = gltf.find("accessors"); accessors != gltf.end())
        checkSparseCounts(*accessors);
    if (const auto cameras = gltf.find("cameras"); cameras != gltf.end())
        checkCameraKinds(*cameras);
    if (const auto animations = gltf.find("animations"); animations != gltf.end())
        checkAnimationSamplers(*animations);
}

}  // namespace peeler
