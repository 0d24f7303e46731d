// SPDX-License-Identifier: Apache-2.0
// Gaussian splats of a glTF file (KHR_gaussian_splatting).
#include <algorithm>
#include <array>
#include <cmath>

#include <peeler/error.h>
#include "formats/gltf/gltf_parts.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

constexpr const char* kSplatExtension = "KHR_gaussian_splatting";
constexpr int kSplatBytes = 5121, kSplatShorts = 5123, kSplatFloats = 5126;

const AccessorFormat kSplatRotation = {{4}, {{kSplatFloats}, {5120, true}, {5122, true}}};
const AccessorFormat kSplatScale = {
    {3},
    {{kSplatFloats}, {kSplatBytes}, {kSplatBytes, true}, {kSplatShorts}, {kSplatShorts, true}}};
const AccessorFormat kSplatOpacity = {{1},
                                      {{kSplatFloats}, {kSplatBytes, true}, {kSplatShorts, true}}};
const AccessorFormat kSplatHarmonic = {{3}, {{kSplatFloats}}};

/// A property of the extension, and its supported values, separated by spaces.
struct SplatWord {
    const char *name, *values;
};
constexpr const char* kLinearSplats = "lin_rec709_display";
constexpr SplatWord kSplatWords[] = {{"kernel", "ellipse"},
                                     {"colorSpace", "srgb_rec709_display lin_rec709_display"},
                                     {"projection", "perspective"},
                                     {"sortingMethod", "cameraDistance"}};

constexpr int kMostSplatDegree = 3;

std::string splatAttribute(const std::string& name) {
    return std::string(kSplatExtension) + ':' + name;
}

std::string harmonicName(int degree, int coefficient) {
    return splatAttribute("SH_DEGREE_" + std::to_string(degree) + "_COEF_" +
                          std::to_string(coefficient));
}

/// Returns the names of all attributes of the extension, harmonics last.
std::vector<std::string> splatAttributeNames() {
    std::vector<std::string> names = {splatAttribute("ROTATION"), splatAttribute("SCALE"),
                                      splatAttribute("OPACITY")};
    for (int degree = 0; degree <= kMostSplatDegree; ++degree)
        for (int i = 0; i <= 2 * degree; ++i)
            names.push_back(harmonicName(degree, i));
    return names;
}

[[noreturn]] void refuseSplats(const std::string& what, const std::string& where) {
    throw Error(ErrorKind::kInput, what, where,
                std::string("export plain ") + kSplatExtension + ", or convert the splats to PLY");
}

/// Checks the properties of the extension. Returns whether the colours are linear.
bool checkSplatWords(const tinygltf::Value& extension, const std::string& where) {
    for (const auto& [name, values] : kSplatWords) {
        const tinygltf::Value* const word = findMember(extension, name);
        if (!word) continue;
        const std::string given = word->Get<std::string>();
        if (given.empty() ||
            (' ' + std::string(values) + ' ').find(' ' + given + ' ') == std::string::npos)
            refuseSplats(std::string(name) + " \"" + given + "\" is not supported",
                         childPointer(where, name));
    }
    if (const tinygltf::Value* const more = findMember(extension, "extensions");
        more && !more->Keys().empty())
        refuseSplats(more->Keys().front() + " is not supported",
                     childPointer(where + "/extensions", more->Keys().front()));
    return findMember(extension, "colorSpace")->Get<std::string>() == kLinearSplats;
}

/// Reads the attributes of splats, with checks of their presence and values.
class SplatReader {
  public:
    SplatReader(GltfDocument& document, const tinygltf::Primitive& primitive, std::string where,
                const ReadAttribute& read)
        : document_(document), primitive_(primitive), where_(std::move(where)), read_(read) {}

    Splats read() {
        const std::string place = childPointer(where_ + "/extensions", kSplatExtension);
        splats_.linear = checkSplatWords(primitive_.extensions.at(kSplatExtension), place);
        splats_.by_distance = true;  // the only sortingMethod, and the default
        if (primitive_.mode != TINYGLTF_MODE_POINTS)
            failGltf("splats must be points (mode 0)", where_ + "/mode");
        for (int degree = 1; degree <= kMostSplatDegree; ++degree)
            for (int i = 0; i <= 2 * degree; ++i)
                if (primitive_.attributes.contains(harmonicName(degree, i)))
                    splats_.degree = degree;
        readRotations();
        readScales();
        readOpacities();
        readHarmonics();
        return std::move(splats_);
    }

  private:
    std::string placeOf(const std::string& name) const {
        return childPointer(where_ + "/attributes", name);
    }

    std::vector<float> values(const std::string& name, const AccessorFormat& format) {
        if (!primitive_.attributes.contains(name))
            failGltf("the splats have no " + name, where_ + "/attributes");
        return read_(name, format);
    }

    [[noreturn]] void refuseValue(const std::string& name, std::size_t splat,
                                  const std::string& what) const {
        failGltf("splat " + std::to_string(splat) + " has " + what, placeOf(name));
    }

    void readRotations() {
        constexpr double kStorageError = 0.02;  // twice the error of signed bytes
        const std::string name = splatAttribute("ROTATION");
        const std::vector<float> given = values(name, kSplatRotation);
        bool unit = true;
        splats_.rotations.reserve(given.size() / 4);
        for (std::size_t i = 0; i < given.size(); i += 4) {
            const glm::dvec4 turn(given[i], given[i + 1], given[i + 2], given[i + 3]);
            const double length = glm::length(turn);
            if (length == 0) refuseValue(name, i / 4, "a rotation of zeros");
            unit = unit && std::abs(length - 1) <= kStorageError;
            splats_.rotations.emplace_back(turn / length);
        }
        if (!unit)
            document_.warn("The attribute " + placeOf(name) +
                               " has quaternions that are not of unit length; they are normalised.",
                           placeOf(name));
    }

    void readScales() {
        const std::string name = splatAttribute("SCALE");
        const std::vector<float> given = values(name, kSplatScale);
        splats_.scales.reserve(given.size() / 3);
        for (std::size_t i = 0; i < given.size(); i += 3) {
            splats_.scales.emplace_back(given[i], given[i + 1], given[i + 2]);
            if (glm::any(glm::lessThan(splats_.scales.back(), glm::vec3(0))))
                refuseValue(name, i / 3, "a negative scale");
        }
    }

    void readOpacities() {
        const std::string name = splatAttribute("OPACITY");
        splats_.opacities = values(name, kSplatOpacity);
        const auto odd = std::ranges::find_if(
            splats_.opacities, [](float opacity) { return opacity < 0 || opacity > 1; });
        if (odd != splats_.opacities.end())
            refuseValue(name, static_cast<std::size_t>(odd - splats_.opacities.begin()),
                        "an opacity outside 0 to 1");
    }

    void readHarmonics() {
        const std::size_t coefficients = splats_.coefficients();
        std::size_t coefficient = 0;
        for (int degree = 0; degree <= splats_.degree; ++degree) {
            for (int i = 0; i <= 2 * degree; ++i, ++coefficient) {
                const std::vector<float> given = values(harmonicName(degree, i), kSplatHarmonic);
                splats_.harmonics.resize(given.size() / 3 * coefficients);
                for (std::size_t k = 0; k < given.size(); k += 3)
                    splats_.harmonics[k / 3 * coefficients + coefficient] = {given[k], given[k + 1],
                                                                             given[k + 2]};
            }
        }
    }

    GltfDocument& document_;
    const tinygltf::Primitive& primitive_;
    std::string where_;
    const ReadAttribute& read_;
    Splats splats_;
};

}  // namespace

bool isGltfSplats(const tinygltf::Primitive& primitive) {
    return primitive.extensions.contains(kSplatExtension);
}

bool isSplatAttributeName(std::string_view name) {
    static const std::vector<std::string> names = splatAttributeNames();
    return std::ranges::find(names, name) != names.end();
}

Splats readGltfSplats(GltfDocument& document, const tinygltf::Primitive& primitive,
                      const std::string& where, const ReadAttribute& read) {
    return SplatReader(document, primitive, where, read).read();
}

}  // namespace peeler
