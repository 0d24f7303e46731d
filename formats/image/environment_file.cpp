// SPDX-License-Identifier: Apache-2.0
// Conversion of a flat picture to an environment, and checks of its values.
#include "formats/image/environment_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <peeler/error.h>
#include "core/shading/constants.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/image/exr_headers.h"
#include "formats/image/flat_image.h"

namespace peeler {
namespace {

[[noreturn]] void failEnvironment(const std::string& what, const std::string& path,
                                  const std::string& hint) {
    throw Error(ErrorKind::kInput, what, path, hint);
}

std::uint64_t hashOf(const Environment& environment) {
    return contentHash(std::as_bytes(std::span(environment.radiance)),
                       static_cast<std::uint64_t>(environment.width));
}

constexpr const char* kEnvironments = "give an equirectangular picture as .hdr (Radiance) or .exr";

/// Adds a note, which is a clause, to the warnings as a sentence.
void warnOf(const std::string& path, const std::string& note, ReadWarnings& warnings) {
    warnings.warn("The environment \"" + path + "\": " + note + ".", path);
}

/// Returns an attribute's value. Reads as many bytes as the type has.
template <class Value>
Value valueOf(const RegularFile& file, const ExrHeaders::Attribute& attribute) {
    Value value{};
    std::array<char, sizeof(Value)> bytes{};
    file.readSome(attribute.place, bytes);
    std::memcpy(&value, bytes.data(), sizeof(Value));
    return value;
}

/// Rejects cube maps. Warns about primaries other than Rec. 709 and about parts that are not read.
void checkExrEnvironment(const std::string& path, ReadWarnings& warnings) {
    constexpr std::uint8_t kCube = 1;  // ENVMAP_CUBE in ImfEnvmap.h
    constexpr std::array<float, 8> kRec709 = {0.64F, 0.33F, 0.3F,    0.6F,
                                              0.15F, 0.06F, 0.3127F, 0.329F};
    const RegularFile file(path);
    file.check();
    ExrHeaders headers(file, path);
    ExrHeaders::Attribute attribute;
    int parts = 0;
    for (; headers.nextPart(); ++parts)
        while (headers.nextAttribute(attribute)) {
            if (parts > 0) continue;
            if (attribute.type == "envmap" && valueOf<std::uint8_t>(file, attribute) == kCube)
                failEnvironment("it is a cube map (attribute envmap)", path,
                                "make it equirectangular: exrenvmap -l IN.exr OUT.exr");
            if (attribute.type != "chromaticities") continue;
            const auto stored = valueOf<std::array<float, 8>>(file, attribute);
            if (!std::ranges::equal(stored, kRec709,
                                    [](float a, float b) { return std::abs(a - b) < 2e-3F; }))
                warnOf(path, "its primaries are not those of Rec. 709; colours are not converted",
                       warnings);
        }
    if (parts > 1)
        warnOf(path, "it has " + std::to_string(parts) + " parts; the first one is used", warnings);
}

/// Warns if the picture is not twice as wide as high, the shape of an equirectangular picture.
void checkShape(const Environment& environment, const std::string& path, ReadWarnings& warnings) {
    constexpr int kRounding = 2;  // tolerance, in pixels
    if (std::abs(environment.width - 2 * environment.height) <= kRounding) return;
    warnOf(path,
           "it has " + std::to_string(environment.width) + " x " +
               std::to_string(environment.height) +
               " pixels, but an equirectangular picture is twice as wide as high; it is stretched",
           warnings);
}

}  // namespace

Environment readEnvironment(const std::string& path, ReadWarnings& warnings,
                            const EnvironmentLimits& limits) {
    const FileKind kind = fileKind(path);
    if (kind != FileKind::kHdr && kind != FileKind::kExr)
        failEnvironment("it is neither a Radiance nor an OpenEXR file", path, kEnvironments);
    const FlatImage flat = readFlatImage(path, {limits.max_side, limits.max_bytes});
    for (const std::string& note : flat.notes)
        warnOf(path, note, warnings);
    if (kind == FileKind::kExr) checkExrEnvironment(path, warnings);
    if (flat.width < 1 || flat.height < 1 || flat.width > limits.max_side ||
        flat.height > limits.max_side ||
        std::uint64_t{16} * static_cast<std::uint64_t>(flat.width) *
                static_cast<std::uint64_t>(flat.height) >
            limits.max_bytes)
        failEnvironment("the display window is empty or too large", path, kEnvironments);

    Environment environment;
    environment.width = flat.width;
    environment.height = flat.height;
    environment.radiance.assign(
        static_cast<std::size_t>(flat.width) * static_cast<std::size_t>(flat.height), glm::vec3(0));
    checkShape(environment, path, warnings);
    const Window& window = flat.image.window;
    float least = 0;
    for (int y = std::max(0, window.y0); y < std::min(flat.height, window.y1); ++y) {
        for (int x = std::max(0, window.x0); x < std::min(flat.width, window.x1); ++x) {
            const auto from =
                static_cast<std::size_t>(y - window.y0) * static_cast<std::size_t>(window.width()) +
                static_cast<std::size_t>(x - window.x0);
            const auto& color = flat.image.rgba[from];
            glm::vec3& to =
                environment
                    .radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(flat.width) +
                              static_cast<std::size_t>(x)];
            for (std::size_t c = 0; c < 3; ++c) {
                if (!std::isfinite(color[c]))
                    failEnvironment("the pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                                        ") is not finite",
                                    path, "clamp infinities and NaNs when you save the picture");
                least = std::min(least, color[c]);
                to[static_cast<int>(c)] = std::max(0.0F, color[c]);
            }
        }
    }
    // Values from this limit to 0 cause no warning, since sharpening filters produce them.
    constexpr float kRinging = -0.01F;
    if (least < kRinging) warnOf(path, "it has negative numbers; they are taken as 0", warnings);
    environment.content_hash = hashOf(environment);
    return environment;
}

Environment namedStudio() {
    Environment environment = embeddedStudio();
    environment.content_hash = hashOf(environment);
    return environment;
}

Environment environmentNamed(const std::string& name_or_path, ReadWarnings& warnings) {
    return name_or_path == kStudioName ? namedStudio() : readEnvironment(name_or_path, warnings);
}

}  // namespace peeler
