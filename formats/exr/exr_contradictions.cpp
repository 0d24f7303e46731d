// SPDX-License-Identifier: Apache-2.0
// Comparison of camera attributes with the double-precision camera from which they were computed.
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <new>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_stream.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

constexpr const char* kCameraJson = "peeler:cameraJson";

/// The attributes derived from the camera. A header must lack those of the other projection.
constexpr const char* kOfCamera[] = {"worldToCamera",
                                     "worldToNDC",
                                     "near",
                                     "far",
                                     "fieldOfViewHorizontal",
                                     "fieldOfViewVertical",
                                     "orthographicWidth",
                                     "orthographicHeight",
                                     "screenWindowCenter",
                                     "screenWindowWidth",
                                     "pixelAspectRatio",
                                     "peeler:projection",
                                     "peeler:depth",
                                     "peeler:lens"};

std::vector<float> numbersOf(const Imf::Attribute& attribute) {
    if (const auto* one = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
        return {one->value()};
    if (const auto* two = dynamic_cast<const Imf::V2fAttribute*>(&attribute))
        return {two->value().x, two->value().y};
    if (const auto* all = dynamic_cast<const Imf::M44fAttribute*>(&attribute))
        return {all->value().getValue(), all->value().getValue() + 16};
    return {};
}

/// Whether values agree, apart from rounding. Other compilers and machines may round the last bits
/// of double-precision results differently. A float may then differ by one ulp and, where large
/// numbers cancel out, be 0 instead of tiny.
bool areClose(const std::vector<float>& found, const std::vector<float>& wanted) {
    constexpr float kRelative = 4 * std::numeric_limits<float>::epsilon(), kOfLargest = 1e-9F;
    float largest = 0;
    for (const float number : wanted)
        if (std::isfinite(number)) largest = std::max(largest, std::abs(number));
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (found[i] == wanted[i]) continue;
        // The negated comparison also rejects NaN.
        const float most = kRelative * std::abs(wanted[i]) + kOfLargest * largest;
        if (!std::isfinite(wanted[i]) || !(std::abs(found[i] - wanted[i]) <= most)) return false;
    }
    return true;
}

bool areSame(const Imf::Attribute& found, const Imf::Attribute& wanted) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&wanted)) {
        const auto* other = dynamic_cast<const Imf::StringAttribute*>(&found);
        return other && other->value() == text->value();
    }
    const std::vector<float> numbers = numbersOf(found), of_camera = numbersOf(wanted);
    return numbers.size() == of_camera.size() && areClose(numbers, of_camera);
}

/// Returns the names of a header's attributes that contradict its `peeler:cameraJson`.
std::vector<std::string> deniedBy(const Imf::Header& header) {
    const auto* json = header.findTypedAttribute<Imf::StringAttribute>(kCameraJson);
    if (!json) return {};
    Plan plan;
    plan.view = viewFromJson(json->value());
    plan.view.known = true;
    const Imf::Header wanted = exrHeader(plan, {}, plan.view.crop);
    std::vector<std::string> denied;
    for (const char* name : kOfCamera) {
        const auto expected = wanted.find(name), found = header.find(name);
        if (expected == wanted.end()) continue;
        if (found == header.end() || !areSame(found.attribute(), expected.attribute()))
            denied.emplace_back(name);
    }
    return denied;
}

}  // namespace

std::vector<std::string> headerContradictions(const std::string& path) {
    // For each contradictory attribute, the name of the first part that has it.
    std::map<std::string, std::string> first_part;
    for (const std::string& file : exrFilesOf(path)) {
        try {
            const RegularFile opened(file);
            opened.check();
            ExrStream stream(opened, file);
            const Imf::MultiPartInputFile input(stream, 0, false);
            for (int part = 0; part < input.parts(); ++part) {
                const Imf::Header& header = input.header(part);
                const std::string name = header.hasName() ? header.name() : "";
                for (const std::string& denied : deniedBy(header))
                    first_part.emplace(denied, name);
            }
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& problem) {
            throw Error(ErrorKind::kInput,
                        std::string("OpenEXR cannot read the file: ") + problem.what(), file,
                        "the file may be damaged; write it again");
        }
    }
    std::vector<std::string> sentences;
    for (const auto& [attribute, part] : first_part) {
        std::string sentence = part.empty() ? "" : part + ": ";
        sentence.append(attribute).append(" contradicts ").append(kCameraJson);
        sentences.push_back(std::move(sentence));
    }
    return sentences;
}

}  // namespace peeler
