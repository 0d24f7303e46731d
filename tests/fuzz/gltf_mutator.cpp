// SPDX-License-Identifier: Apache-2.0
// Mutates a .glb (or .gltf) into another valid container: changes values, keys and indices in the
// parsed JSON, or bytes of the binary chunk, and rebuilds the container.
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "formats/file/read_warnings.h"
#include "formats/gltf/gltf_container.h"
#include "fuzz/fuzz_target.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed);
extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* data1, std::size_t size1,
                                                 const std::uint8_t* data2, std::size_t size2,
                                                 std::uint8_t* out, std::size_t most,
                                                 unsigned seed);

namespace peeler::fuzz {
namespace {

using Json = nlohmann::ordered_json;
using Random = std::minstd_rand;

/// Keys and values of glTF files, without those that the schema always rejects.
constexpr const char* kWords[] = {"accessors",
                                  "alphaCutoff",
                                  "alphaMode",
                                  "animations",
                                  "aspectRatio",
                                  "asset",
                                  "attributes",
                                  "attenuationColor",
                                  "attenuationDistance",
                                  "BLEND",
                                  "baseColorFactor",
                                  "baseColorTexture",
                                  "buffer",
                                  "bufferView",
                                  "bufferViews",
                                  "buffers",
                                  "byteLength",
                                  "byteOffset",
                                  "byteStride",
                                  "CUBICSPLINE",
                                  "camera",
                                  "cameras",
                                  "channels",
                                  "children",
                                  "COLOR_0",
                                  "componentType",
                                  "count",
                                  "doubleSided",
                                  "EXT_mesh_gpu_instancing",
                                  "EXT_meshopt_compression",
                                  "emissiveFactor",
                                  "emissiveTexture",
                                  "extensions",
                                  "extensionsRequired",
                                  "extensionsUsed",
                                  "extras",
                                  "filter",
                                  "image",
                                  "images",
                                  "indices",
                                  "innerConeAngle",
                                  "input",
                                  "intensity",
                                  "interpolation",
                                  "inverseBindMatrices",
                                  "JOINTS_0",
                                  "joints",
                                  "KHR_draco_mesh_compression",
                                  "KHR_lights_punctual",
                                  "KHR_materials_emissive_strength",
                                  "KHR_materials_ior",
                                  "KHR_materials_transmission",
                                  "KHR_materials_unlit",
                                  "KHR_materials_variants",
                                  "KHR_materials_volume",
                                  "KHR_mesh_quantization",
                                  "KHR_meshopt_compression",
                                  "KHR_texture_transform",
                                  "LINEAR",
                                  "light",
                                  "lights",
                                  "MASK",
                                  "MAT4",
                                  "magFilter",
                                  "mapping",
                                  "mappings",
                                  "material",
                                  "materials",
                                  "matrix",
                                  "max",
                                  "mesh",
                                  "meshes",
                                  "metallicFactor",
                                  "metallicRoughnessTexture",
                                  "mimeType",
                                  "min",
                                  "minFilter",
                                  "mode",
                                  "NORMAL",
                                  "name",
                                  "node",
                                  "nodes",
                                  "normalTexture",
                                  "normalized",
                                  "OPAQUE",
                                  "occlusionTexture",
                                  "offset",
                                  "orthographic",
                                  "outerConeAngle",
                                  "output",
                                  "POSITION",
                                  "path",
                                  "pbrMetallicRoughness",
                                  "perspective",
                                  "point",
                                  "primitives",
                                  "ROTATION",
                                  "range",
                                  "rotation",
                                  "roughnessFactor",
                                  "SCALAR",
                                  "SCALE",
                                  "STEP",
                                  "sampler",
                                  "samplers",
                                  "scale",
                                  "scene",
                                  "scenes",
                                  "skeleton",
                                  "skin",
                                  "skins",
                                  "source",
                                  "sparse",
                                  "spot",
                                  "strength",
                                  "TANGENT",
                                  "TEXCOORD_0",
                                  "TEXCOORD_1",
                                  "TRANSLATION",
                                  "target",
                                  "targets",
                                  "texCoord",
                                  "texture",
                                  "textures",
                                  "thicknessFactor",
                                  "translation",
                                  "transmissionFactor",
                                  "type",
                                  "uri",
                                  "VEC2",
                                  "VEC3",
                                  "VEC4",
                                  "values",
                                  "variants",
                                  "version",
                                  "WEIGHTS_0",
                                  "weights",
                                  "wrapS",
                                  "wrapT",
                                  "xmag",
                                  "yfov",
                                  "ymag",
                                  "zfar",
                                  "znear"};

constexpr double kNumbers[] = {-1,    0,     1,      2,     3,     4,    5,          6,
                               8,     12,    16,     255,   256,   0.5,  2147483647, 2147483648.0,
                               5120,  5121,  5122,   5123,  5125,  5126, 4294967295, 4294967296.0,
                               34962, 34963, 65535,  65536, 1e-30, 1e30, 1e300,      -2147483648.0,
                               9729,  9987,  -1e-30, 33071, 10497, 1e10, -1e300,     1.8446744e19};

struct Parsed {
    Json json;
    std::vector<std::uint8_t> binary;
    bool glb = false;
};

std::optional<Parsed> parsed(Input bytes) {
    try {
        ReadWarnings warnings(false, {});
        const GltfContainer parts = splitGltfContainer(bytes, "", warnings);
        Parsed result{parseOrderedGltfJson(parts.json, ""), {}, isGlb(bytes)};
        if (parts.binary) result.binary.assign(parts.binary->begin(), parts.binary->end());
        return result;
    } catch (const std::exception&) {
        return std::nullopt;
    }
}

/// Stores the file in `out`. Returns the number of bytes; 0 if it exceeds `most`.
std::size_t store(const Parsed& file, std::uint8_t* out, std::size_t most) {
    std::string text = file.json.dump(-1, ' ', false, Json::error_handler_t::replace);
    std::string bytes;
    if (file.glb) {
        const auto number = [](std::size_t value) {
            const auto bits = static_cast<std::uint32_t>(value);
            return std::string(reinterpret_cast<const char*>(&bits), sizeof bits);
        };
        std::string binary(file.binary.begin(), file.binary.end());
        text.resize((text.size() + 3) / 4 * 4, ' ');
        binary.resize((binary.size() + 3) / 4 * 4, '\0');
        std::string chunks = number(text.size()) + "JSON" + text;
        if (!binary.empty()) chunks += number(binary.size()) + std::string("BIN\0", 4) + binary;
        bytes = "glTF" + number(2) + number(12 + chunks.size()) + chunks;
    } else {
        bytes = std::move(text);
    }
    if (bytes.size() > most) return 0;
    std::memcpy(out, bytes.data(), bytes.size());
    return bytes.size();
}

/// Lists every value of a document, beginning with the root.
void listValues(Json& value, std::vector<Json*>& all) {
    all.push_back(&value);
    if (value.is_structured())
        for (Json& each : value)
            listValues(each, all);
}

class Mutator {
  public:
    explicit Mutator(unsigned seed) : random_(seed) {}

    std::size_t below(std::size_t count) { return random_() % count; }

    /// Changes the file in one to four places.
    void mutate(Parsed& file) {
        for (std::size_t left = 1 + below(4); left > 0; --left) {
            if (!file.binary.empty() && below(3) == 0)
                mutateBinary(file);
            else
                mutateJson(file.json);
        }
    }

    /// Replaces a value of this file with a value from another file.
    void cross(Json& json, Json& other) {
        Json& from = anyOf(other);
        Json& to = anyOf(json);
        if (&to == &json || &from == &other) return;
        if (to.is_array() && from.is_array() && !from.empty())
            to.push_back(from[below(from.size())]);
        else
            to = Json(from);
    }

  private:
    Json& anyOf(Json& json) {
        std::vector<Json*> all;
        listValues(json, all);
        return *all[below(all.size())];
    }

    std::string word() { return kWords[below(std::size(kWords))]; }

    void mutateBinary(Parsed& file) {
        const std::size_t size = file.binary.size();
        file.binary.resize(size + below(65));
        file.binary.resize(LLVMFuzzerMutate(file.binary.data(), size, file.binary.size()));
        // Usually correct the buffer's length, because a buffer longer than the chunk is rejected
        // at once.
        if (below(8) != 0 && file.json.contains("buffers") && file.json["buffers"].is_array() &&
            !file.json["buffers"].empty() && file.json["buffers"][0].is_object())
            file.json["buffers"][0]["byteLength"] = file.binary.size();
    }

    void mutateJson(Json& json) {
        Json& value = anyOf(json);
        if (value.is_number() && below(8) != 0)
            mutateNumber(value);
        else if (value.is_string() && below(4) != 0)
            mutateString(value);
        else if (value.is_boolean())
            value = !value.get<bool>();
        else if (value.is_array() && below(8) != 0)
            mutateArray(value, json);
        else if (value.is_object())
            mutateObject(value, json);
        else
            value = anyValue(json);
    }

    void mutateNumber(Json& value) {
        const auto number = value.get<double>();
        const bool whole = value.is_number_integer() && std::abs(number) < 1e9;
        const std::size_t how = below(6);
        if (whole && how < 3)
            value = static_cast<int>(number) + static_cast<int>(below(how == 0 ? 3 : 33)) -
                    (how == 0 ? 1 : 16);
        else if (whole && how == 3)
            value = static_cast<std::int64_t>(number) << below(34);
        else if (how == 4)
            value = number * (static_cast<double>(below(4001)) / 1000 - 2);
        else
            value = anyNumber();
    }

    Json anyNumber() {
        const double number = kNumbers[below(std::size(kNumbers))];
        const bool whole = std::abs(number) < 1e15 && number == std::floor(number);
        return whole ? Json(static_cast<std::int64_t>(number)) : Json(number);
    }

    void mutateString(Json& value) {
        auto text = value.get<std::string>();
        if (below(3) == 0) {
            value = word();
            return;
        }
        const std::size_t size = text.size();
        text.resize(size + 8);
        text.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(text.data()), size, size + 8));
        value = text;
    }

    void mutateArray(Json& array, Json& json) {
        const std::size_t how = below(5);
        if (array.empty() || how == 0)
            array.push_back(anyValue(json));
        else if (how == 1)
            array.erase(below(array.size()));
        else if (how == 2)
            array.push_back(Json(array[below(array.size())]));
        else if (how == 3)
            std::swap(array[below(array.size())], array[below(array.size())]);
        else
            array[below(array.size())] = anyValue(json);
    }

    void mutateObject(Json& object, Json& json) {
        const std::size_t how = below(4);
        if (object.empty() || how == 0) {
            object[word()] = anyValue(json);
            return;
        }
        auto member = object.begin();
        std::advance(member, below(object.size()));
        const std::string key = member.key();
        if (how == 1)
            object.erase(key);
        else if (how == 2)
            object[word()] = Json(member.value());
        else
            object[key] = anyValue(json);
    }

    /// Returns a copy of an existing value, or a new value.
    Json anyValue(Json& json) {
        const std::size_t how = below(7);
        if (how == 0) return anyNumber();
        if (how == 1) return word();
        if (how == 2) return Json::array({anyNumber(), anyNumber(), anyNumber()});
        if (how == 3) return Json{{word(), anyNumber()}};
        const Json& value = anyOf(json);
        return &value == &json ? Json() : Json(value);
    }

    Random random_;
};

}  // namespace
}  // namespace peeler::fuzz

std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                    unsigned seed) {
    peeler::fuzz::Mutator mutator(seed);
    auto file = peeler::fuzz::parsed({data, size});
    if (!file || mutator.below(32) == 0) return LLVMFuzzerMutate(data, size, most);
    mutator.mutate(*file);
    const std::size_t stored = peeler::fuzz::store(*file, data, most);
    return stored > 0 ? stored : LLVMFuzzerMutate(data, size, most);
}

std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* data1, std::size_t size1,
                                      const std::uint8_t* data2, std::size_t size2,
                                      std::uint8_t* out, std::size_t most, unsigned seed) {
    auto first = peeler::fuzz::parsed({data1, size1});
    auto second = peeler::fuzz::parsed({data2, size2});
    if (!first || !second) return 0;
    peeler::fuzz::Mutator(seed).cross(first->json, second->json);
    return peeler::fuzz::store(*first, out, most);
}
