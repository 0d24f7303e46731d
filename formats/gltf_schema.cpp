// SPDX-License-Identifier: Apache-2.0
// The parts of the glTF 2.0 JSON schema that we read, as a table, and its check.
#include "formats/gltf_schema.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"

namespace peeler {
namespace {

using nlohmann::json;

enum class Kind {
    kBool,
    kString,      ///< `of` lists the allowed values, separated by spaces; empty = any
    kStrings,     ///< array
    kNumber,      ///< finite as a 32-bit float
    kPositive,    ///< a number above zero
    kNumbers,     ///< array of `max` numbers
    kNumberList,  ///< array of any number of them
    kInteger,     ///< min … max
    kEnum,        ///< integer; `of` lists the allowed values
    kIndex,       ///< into the array at the path `of` from the root
    kIndices,     ///< array of such
    kIndexMap,    ///< object with such values
    kIndexMaps,   ///< array of such objects
    kIntegerMap,  ///< object with values that are integers, min … max
    kObject,      ///< `of` is the name of the rows
    kObjects,     ///< array of such
    kExtensions,  ///< object; members named like rows, or like rows of "owner/name", are checked
};

constexpr const char* kHint = "check the file with the Khronos glTF validator";

constexpr double kAnySize = 9007199254740992.0;  // 2^53: what JSON numbers hold exactly
constexpr double kIntMax = std::numeric_limits<int>::max();

struct Property {
    const char* owner;
    const char* name;
    Kind kind;
    const char* of = "";
    bool required = false;
    double min = 0;
    double max = kAnySize;
};

// glTF 2.0 §5. Names and extras are never needed, so a wrong one is no reason to refuse a file.
constexpr Property kProperties[] = {
    {"root", "asset", Kind::kObject, "asset", true},
    {"root", "extensionsUsed", Kind::kStrings},
    {"root", "extensionsRequired", Kind::kStrings},
    {"root", "scene", Kind::kIndex, "scenes"},
    {"root", "scenes", Kind::kObjects, "scene"},
    {"root", "nodes", Kind::kObjects, "node"},
    {"root", "meshes", Kind::kObjects, "mesh"},
    {"root", "accessors", Kind::kObjects, "accessor"},
    {"root", "bufferViews", Kind::kObjects, "bufferView"},
    {"root", "buffers", Kind::kObjects, "buffer"},
    {"root", "materials", Kind::kObjects, "material"},
    {"root", "textures", Kind::kObjects, "texture"},
    {"root", "images", Kind::kObjects, "image"},
    {"root", "samplers", Kind::kObjects, "sampler"},
    {"root", "cameras", Kind::kObjects, "camera"},
    {"root", "skins", Kind::kObjects, "skin"},
    {"root", "animations", Kind::kObjects, "animation"},
    {"root", "extensions", Kind::kExtensions},

    {"asset", "version", Kind::kString, "", true},
    {"asset", "minVersion", Kind::kString},

    {"scene", "nodes", Kind::kIndices, "nodes"},

    {"node", "children", Kind::kIndices, "nodes"},
    {"node", "mesh", Kind::kIndex, "meshes"},
    {"node", "camera", Kind::kIndex, "cameras"},
    {"node", "skin", Kind::kIndex, "skins"},
    {"node", "matrix", Kind::kNumbers, "", false, 0, 16},
    {"node", "translation", Kind::kNumbers, "", false, 0, 3},
    {"node", "rotation", Kind::kNumbers, "", false, 0, 4},
    {"node", "scale", Kind::kNumbers, "", false, 0, 3},
    {"node", "weights", Kind::kNumberList},
    {"node", "extensions", Kind::kExtensions},

    {"skin", "inverseBindMatrices", Kind::kIndex, "accessors"},
    {"skin", "joints", Kind::kIndices, "nodes", true},
    {"animation", "channels", Kind::kObjects, "channel", true},
    {"animation", "samplers", Kind::kObjects, "animationSampler", true},
    {"channel", "sampler", Kind::kInteger, "", true, 0, kIntMax},  // into the same animation's
    {"channel", "target", Kind::kObject, "target", true},
    {"target", "node", Kind::kIndex, "nodes"},
    {"target", "path", Kind::kString, "", true},  // extensions add others
    {"animationSampler", "input", Kind::kIndex, "accessors", true},
    {"animationSampler", "output", Kind::kIndex, "accessors", true},
    {"animationSampler", "interpolation", Kind::kString, "LINEAR STEP CUBICSPLINE"},

    {"mesh", "primitives", Kind::kObjects, "primitive", true},
    {"mesh", "weights", Kind::kNumberList},
    {"primitive", "attributes", Kind::kIndexMap, "accessors", true},
    {"primitive", "indices", Kind::kIndex, "accessors"},
    {"primitive", "material", Kind::kIndex, "materials"},
    {"primitive", "mode", Kind::kEnum, "0 1 2 3 4 5 6"},
    {"primitive", "targets", Kind::kIndexMaps, "accessors"},
    {"primitive", "extensions", Kind::kExtensions},

    {"accessor", "bufferView", Kind::kIndex, "bufferViews"},
    {"accessor", "byteOffset", Kind::kInteger},
    {"accessor", "componentType", Kind::kEnum, "5120 5121 5122 5123 5125 5126", true},
    {"accessor", "normalized", Kind::kBool},
    {"accessor", "count", Kind::kInteger, "", true, 1},
    {"accessor", "type", Kind::kString, "SCALAR VEC2 VEC3 VEC4 MAT2 MAT3 MAT4", true},
    {"accessor", "sparse", Kind::kObject, "sparse"},
    {"sparse", "count", Kind::kInteger, "", true, 1, kIntMax},
    {"sparse", "indices", Kind::kObject, "sparseIndices", true},
    {"sparse", "values", Kind::kObject, "sparseValues", true},
    {"sparseIndices", "bufferView", Kind::kIndex, "bufferViews", true},
    {"sparseIndices", "byteOffset", Kind::kInteger, "", false, 0, kIntMax},
    {"sparseIndices", "componentType", Kind::kEnum, "5121 5123 5125", true},
    {"sparseValues", "bufferView", Kind::kIndex, "bufferViews", true},
    {"sparseValues", "byteOffset", Kind::kInteger, "", false, 0, kIntMax},

    {"bufferView", "buffer", Kind::kIndex, "buffers", true},
    {"bufferView", "byteOffset", Kind::kInteger},
    {"bufferView", "byteLength", Kind::kInteger, "", true, 1},
    {"bufferView", "byteStride", Kind::kInteger, "", false, 4, 252},
    {"bufferView", "extensions", Kind::kExtensions},
    {"buffer", "uri", Kind::kString},
    {"buffer", "byteLength", Kind::kInteger, "", true, 1},
    {"buffer", "extensions", Kind::kExtensions},

    {"material", "pbrMetallicRoughness", Kind::kObject, "pbrMetallicRoughness"},
    {"material", "normalTexture", Kind::kObject, "normalTextureInfo"},
    {"material", "occlusionTexture", Kind::kObject, "occlusionTextureInfo"},
    {"material", "emissiveTexture", Kind::kObject, "textureInfo"},
    {"material", "emissiveFactor", Kind::kNumbers, "", false, 0, 3},
    {"material", "alphaMode", Kind::kString, "OPAQUE MASK BLEND"},
    {"material", "alphaCutoff", Kind::kNumber},
    {"material", "doubleSided", Kind::kBool},
    {"material", "extensions", Kind::kExtensions},
    {"pbrMetallicRoughness", "baseColorFactor", Kind::kNumbers, "", false, 0, 4},
    {"pbrMetallicRoughness", "baseColorTexture", Kind::kObject, "textureInfo"},
    {"pbrMetallicRoughness", "metallicFactor", Kind::kNumber},
    {"pbrMetallicRoughness", "roughnessFactor", Kind::kNumber},
    {"pbrMetallicRoughness", "metallicRoughnessTexture", Kind::kObject, "textureInfo"},
    {"textureInfo", "index", Kind::kIndex, "textures", true},
    {"textureInfo", "texCoord", Kind::kInteger, "", false, 0, kIntMax},
    {"textureInfo", "extensions", Kind::kExtensions},
    {"normalTextureInfo", "index", Kind::kIndex, "textures", true},
    {"normalTextureInfo", "texCoord", Kind::kInteger, "", false, 0, kIntMax},
    {"normalTextureInfo", "scale", Kind::kNumber},
    {"normalTextureInfo", "extensions", Kind::kExtensions},
    {"occlusionTextureInfo", "index", Kind::kIndex, "textures", true},
    {"occlusionTextureInfo", "texCoord", Kind::kInteger, "", false, 0, kIntMax},
    {"occlusionTextureInfo", "strength", Kind::kNumber},
    {"occlusionTextureInfo", "extensions", Kind::kExtensions},

    {"texture", "sampler", Kind::kIndex, "samplers"},
    {"texture", "source", Kind::kIndex, "images"},
    {"texture", "extensions", Kind::kExtensions},
    {"image", "uri", Kind::kString},
    {"image", "bufferView", Kind::kIndex, "bufferViews"},
    {"sampler", "magFilter", Kind::kEnum, "9728 9729"},
    {"sampler", "minFilter", Kind::kEnum, "9728 9729 9984 9985 9986 9987"},
    {"sampler", "wrapS", Kind::kEnum, "10497 33071 33648"},
    {"sampler", "wrapT", Kind::kEnum, "10497 33071 33648"},

    {"camera", "type", Kind::kString, "perspective orthographic", true},
    {"camera", "perspective", Kind::kObject, "perspective"},
    {"camera", "orthographic", Kind::kObject, "orthographic"},
    {"perspective", "yfov", Kind::kPositive, "", true},
    {"perspective", "aspectRatio", Kind::kPositive},
    {"perspective", "znear", Kind::kPositive, "", true},
    {"perspective", "zfar", Kind::kPositive},
    {"orthographic", "xmag", Kind::kPositive, "", true},
    {"orthographic", "ymag", Kind::kPositive, "", true},
    {"orthographic", "znear", Kind::kNumber, "", true},
    {"orthographic", "zfar", Kind::kPositive, "", true},

    {"KHR_texture_transform", "offset", Kind::kNumbers, "", false, 0, 2},
    {"KHR_texture_transform", "rotation", Kind::kNumber},
    {"KHR_texture_transform", "scale", Kind::kNumbers, "", false, 0, 2},
    {"KHR_texture_transform", "texCoord", Kind::kInteger, "", false, 0, kIntMax},
    {"KHR_materials_emissive_strength", "emissiveStrength", Kind::kNumber},
    {"KHR_materials_ior", "ior", Kind::kNumber},
    {"KHR_materials_specular", "specularFactor", Kind::kNumber},
    {"KHR_materials_specular", "specularTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_specular", "specularColorFactor", Kind::kNumbers, "", false, 0, 3},
    {"KHR_materials_specular", "specularColorTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_clearcoat", "clearcoatFactor", Kind::kNumber},
    {"KHR_materials_clearcoat", "clearcoatTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_clearcoat", "clearcoatRoughnessFactor", Kind::kNumber},
    {"KHR_materials_clearcoat", "clearcoatRoughnessTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_clearcoat", "clearcoatNormalTexture", Kind::kObject, "normalTextureInfo"},
    {"KHR_materials_sheen", "sheenColorFactor", Kind::kNumbers, "", false, 0, 3},
    {"KHR_materials_sheen", "sheenColorTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_sheen", "sheenRoughnessFactor", Kind::kNumber},
    {"KHR_materials_sheen", "sheenRoughnessTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_anisotropy", "anisotropyStrength", Kind::kNumber},
    {"KHR_materials_anisotropy", "anisotropyRotation", Kind::kNumber},
    {"KHR_materials_anisotropy", "anisotropyTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_iridescence", "iridescenceFactor", Kind::kNumber},
    {"KHR_materials_iridescence", "iridescenceTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_iridescence", "iridescenceIor", Kind::kNumber},
    {"KHR_materials_iridescence", "iridescenceThicknessMinimum", Kind::kNumber},
    {"KHR_materials_iridescence", "iridescenceThicknessMaximum", Kind::kNumber},
    {"KHR_materials_iridescence", "iridescenceThicknessTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_transmission", "transmissionFactor", Kind::kNumber},
    {"KHR_materials_transmission", "transmissionTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_volume", "thicknessFactor", Kind::kNumber},
    {"KHR_materials_volume", "thicknessTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_volume", "attenuationDistance", Kind::kPositive},
    {"KHR_materials_volume", "attenuationColor", Kind::kNumbers, "", false, 0, 3},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseFactor", Kind::kNumbers, "", false, 0, 4},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseTexture", Kind::kObject, "textureInfo"},
    {"KHR_materials_pbrSpecularGlossiness", "specularFactor", Kind::kNumbers, "", false, 0, 3},
    {"KHR_materials_pbrSpecularGlossiness", "glossinessFactor", Kind::kNumber},
    {"KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture", Kind::kObject,
     "textureInfo"},
    // KHR_materials_variants names one member in the root and another in primitives.
    {"root/KHR_materials_variants", "variants", Kind::kObjects, "variant", true},
    {"variant", "name", Kind::kString, "", true},
    {"primitive/KHR_materials_variants", "mappings", Kind::kObjects, "variantMapping", true},
    {"variantMapping", "material", Kind::kIndex, "materials", true},
    {"variantMapping", "variants", Kind::kIndices, "extensions/KHR_materials_variants/variants",
     true},
    {"EXT_texture_webp", "source", Kind::kIndex, "images"},

    {"EXT_mesh_gpu_instancing", "attributes", Kind::kIndexMap, "accessors", true},
    {"KHR_node_visibility", "visible", Kind::kBool},
    {"primitive/KHR_draco_mesh_compression", "bufferView", Kind::kIndex, "bufferViews", true},
    {"primitive/KHR_draco_mesh_compression", "attributes", Kind::kIntegerMap, "", true, 0, kIntMax},

    // EXT_meshopt_compression; KHR_meshopt_compression has the same JSON.
    {"bufferView/EXT_meshopt_compression", "buffer", Kind::kIndex, "buffers", true},
    {"bufferView/EXT_meshopt_compression", "byteOffset", Kind::kInteger},
    {"bufferView/EXT_meshopt_compression", "byteLength", Kind::kInteger, "", true, 1},
    {"bufferView/EXT_meshopt_compression", "byteStride", Kind::kInteger, "", true, 2, 256},
    {"bufferView/EXT_meshopt_compression", "count", Kind::kInteger, "", true, 1},
    {"bufferView/EXT_meshopt_compression", "mode", Kind::kString, "ATTRIBUTES TRIANGLES INDICES",
     true},
    {"bufferView/EXT_meshopt_compression", "filter", Kind::kString},
    {"buffer/EXT_meshopt_compression", "fallback", Kind::kBool},

    // KHR_lights_punctual names one member in the root and another in nodes.
    {"root/KHR_lights_punctual", "lights", Kind::kObjects, "light", true},
    {"node/KHR_lights_punctual", "light", Kind::kIndex, "extensions/KHR_lights_punctual/lights",
     true},
    {"light", "type", Kind::kString, "", true},  // an unknown one is no error
    {"light", "color", Kind::kNumbers, "", false, 0, 3},
    {"light", "intensity", Kind::kNumber},
    {"light", "range", Kind::kPositive},
    {"light", "spot", Kind::kObject, "spot"},
    {"spot", "innerConeAngle", Kind::kNumber},
    {"spot", "outerConeAngle", Kind::kPositive},
};

/// The rows of one owner.
const std::vector<const Property*>& rowsOf(std::string_view owner) {
    static const auto rows = [] {
        std::map<std::string_view, std::vector<const Property*>> result;
        for (const Property& property : kProperties)
            result[property.owner].push_back(&property);
        return result;
    }();
    static const std::vector<const Property*> none;
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

    // The nesting of the table bounds the recursion, whatever the file holds.
    void object(json& value, const std::string& pointer, std::string_view owner) {
        if (!value.is_object()) refuse(pointer, "must be an object", value);
        for (const Property* property : rowsOf(owner)) {
            const auto found = value.find(property->name);
            if (found != value.end()) {
                member(*found, childPointer(pointer, property->name), *property);
            } else if (property->required) {
                throw Error(
                    ErrorKind::kInput,
                    "the required property \"" + std::string(property->name) + "\" is missing",
                    pointer, kHint);
            }
        }
    }

  private:
    [[noreturn]] static void refuse(const std::string& pointer, const std::string& rule,
                                    const json& value) {
        std::string shown = value.dump(-1, ' ', true, json::error_handler_t::replace);
        if (shown.size() > 40) shown = shown.substr(0, 37) + "...";
        throw Error(ErrorKind::kInput, "the value " + rule + ", it is " + shown, pointer, kHint);
    }

    void member(json& value, const std::string& pointer, const Property& rule) {
        switch (rule.kind) {
            case Kind::kBool:
                if (!value.is_boolean()) refuse(pointer, "must be true or false", value);
                break;
            case Kind::kString:
                string(value, pointer, rule);
                break;
            case Kind::kNumber:
                number(value, pointer);
                break;
            case Kind::kPositive:
                number(value, pointer);
                if (value.get<double>() <= 0) refuse(pointer, "must be above zero", value);
                break;
            case Kind::kInteger:
                integer(value, pointer, rule.min, rule.max);
                break;
            case Kind::kEnum:
                integer(value, pointer, 0, kIntMax);
                if (!listed(rule.of, value.dump()))
                    refuse(pointer, "must be one of " + std::string(rule.of), value);
                break;
            case Kind::kIndex:
                index(value, pointer, rule.of);
                break;
            case Kind::kIndexMap:
                indexMap(value, pointer, rule.of);
                break;
            case Kind::kIntegerMap:
                integerMap(value, pointer, rule);
                break;
            case Kind::kObject:
                object(value, pointer, rule.of);
                break;
            case Kind::kExtensions:
                extensions(value, pointer, rule.owner);
                break;
            case Kind::kStrings:
            case Kind::kNumbers:
            case Kind::kNumberList:
            case Kind::kIndices:
            case Kind::kIndexMaps:
            case Kind::kObjects:
                array(value, pointer, rule);
                break;
        }
    }

    void array(json& value, const std::string& pointer, const Property& rule) {
        if (!value.is_array()) refuse(pointer, "must be an array", value);
        if (rule.kind == Kind::kNumbers && static_cast<double>(value.size()) != rule.max)
            refuse(pointer, "must have " + std::to_string(static_cast<int>(rule.max)) + " elements",
                   value);
        for (std::size_t i = 0; i < value.size(); ++i) {
            const std::string element = childPointer(pointer, i);
            switch (rule.kind) {
                case Kind::kStrings:
                    if (!value[i].is_string()) refuse(element, "must be a string", value[i]);
                    break;
                case Kind::kNumbers:
                case Kind::kNumberList:
                    number(value[i], element);
                    break;
                case Kind::kIndices:
                    index(value[i], element, rule.of);
                    break;
                case Kind::kIndexMaps:
                    indexMap(value[i], element, rule.of);
                    break;
                default:
                    object(value[i], element, rule.of);
                    break;
            }
        }
    }

    static void string(const json& value, const std::string& pointer, const Property& rule) {
        if (!value.is_string()) refuse(pointer, "must be a string", value);
        if (*rule.of && !listed(rule.of, value.get_ref<const std::string&>()))
            refuse(pointer, "must be one of " + std::string(rule.of), value);
    }

    static void number(json& value, const std::string& pointer) {
        if (!value.is_number()) refuse(pointer, "must be a number", value);
        const double number = value.get<double>();
        if (!(std::fabs(number) <= std::numeric_limits<float>::max()))
            refuse(pointer, "must fit a 32-bit float", value);
        // tinygltf truncates large integers to int.
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

    void index(json& value, const std::string& pointer, const char* array_name) {
        const json::json_pointer place('/' + std::string(array_name));
        const std::size_t size = root_.contains(place) && root_[place].is_array()
                                     ? std::min<std::size_t>(root_[place].size(), 1U << 31U)
                                     : 0;
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

    static void integerMap(json& value, const std::string& pointer, const Property& rule) {
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
            if (!rowsOf(key).empty()) object(element, child, key);
            if (const std::string here = childPointer(owner, key); !rowsOf(here).empty())
                object(element, child, here);
        }
    }

    json& root_;
};

/// §5.11: strides are multiples of 4.
void checkStrides(const json& views) {
    for (std::size_t i = 0; i < views.size(); ++i)
        if (const int stride = views[i].value("byteStride", 4); stride % 4 != 0)
            throw Error(ErrorKind::kInput,
                        "the value must be a multiple of 4, it is " + std::to_string(stride),
                        childPointer("/bufferViews", i) + "/byteStride", kHint);
}

/// §5.5: a channel names a sampler of its own animation.
void checkAnimationSamplers(const json& animations) {
    for (std::size_t i = 0; i < animations.size(); ++i) {
        const std::size_t samplers = animations[i]["samplers"].size();
        const json& channels = animations[i]["channels"];
        for (std::size_t j = 0; j < channels.size(); ++j)
            if (channels[j]["sampler"].get<std::size_t>() >= samplers)
                throw Error(
                    ErrorKind::kInput,
                    "the value must be an index into the animation's samplers, which are " +
                        std::to_string(samplers),
                    childPointer(childPointer("/animations", i) + "/channels", j) + "/sampler",
                    kHint);
    }
}

/// §5.2: a sparse accessor substitutes at most as many elements as it has.
void checkSparseCounts(const json& accessors) {
    for (std::size_t i = 0; i < accessors.size(); ++i)
        if (const auto sparse = accessors[i].find("sparse"); sparse != accessors[i].end())
            if ((*sparse)["count"].get<std::uint64_t>() >
                accessors[i]["count"].get<std::uint64_t>())
                throw Error(ErrorKind::kInput,
                            "more elements are substituted than the accessor has",
                            childPointer("/accessors", i) + "/sparse/count", kHint);
}

/// §3.10: a camera holds the object that its type names.
void checkCameraKinds(const json& cameras) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const json& camera = cameras[i];
        const std::string& type = camera["type"].get_ref<const std::string&>();
        if (!camera.contains(type))
            throw Error(ErrorKind::kInput, "the required property \"" + type + "\" is missing",
                        childPointer("/cameras", i), kHint);
    }
}

}  // namespace

std::string childPointer(const std::string& parent, std::string_view key) {
    std::string result = parent + '/';
    for (const char c : key) {
        if (c == '~')
            result += "~0";
        else if (c == '/')
            result += "~1";
        else
            result += c;
    }
    return result;
}

std::string childPointer(const std::string& parent, std::size_t index) {
    return parent + '/' + std::to_string(index);
}

void checkGltfSchema(json& gltf) {
    SchemaCheck(gltf).object(gltf, "", "root");
    // What a table cannot say.
    if (const auto views = gltf.find("bufferViews"); views != gltf.end()) checkStrides(*views);
    if (const auto accessors = gltf.find("accessors"); accessors != gltf.end())
        checkSparseCounts(*accessors);
    if (const auto cameras = gltf.find("cameras"); cameras != gltf.end())
        checkCameraKinds(*cameras);
    if (const auto animations = gltf.find("animations"); animations != gltf.end())
        checkAnimationSamplers(*animations);
}

}  // namespace peeler
