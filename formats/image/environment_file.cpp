// SPDX-License-Identifier: Apache-2.0
// Turns a flat picture into an environment, and checks its numbers.
#include "formats/image/environment_file.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/shading/constants.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
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

}  // namespace

Environment readEnvironment(const std::string& path, const EnvironmentLimits& limits) {
    constexpr const char* kFormats = "give an equirectangular picture as .hdr (Radiance) or .exr";
    const FileKind kind = fileKind(path);
    if (kind != FileKind::kHdr && kind != FileKind::kExr)
        failEnvironment("an environment is neither a Radiance nor an OpenEXR file", path, kFormats);
    const FlatImage flat = readFlatImage(path, {limits.max_side, limits.max_bytes});
    if (flat.width < 1 || flat.height < 1 || flat.width > limits.max_side ||
        flat.height > limits.max_side ||
        std::uint64_t{16} * static_cast<std::uint64_t>(flat.width) *
                static_cast<std::uint64_t>(flat.height) >
            limits.max_bytes)
        failEnvironment("the display window is empty or too large", path, kFormats);

    Environment environment;
    environment.width = flat.width;
    environment.height = flat.height;
    environment.radiance.assign(
        static_cast<std::size_t>(flat.width) * static_cast<std::size_t>(flat.height), glm::vec3(0));
    const Window& window = flat.image.window;
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
                to[static_cast<int>(c)] = std::max(0.0F, color[c]);
            }
        }
    }
    environment.content_hash = hashOf(environment);
    return environment;
}

Environment environmentNamed(const std::string& name_or_path) {
    if (name_or_path != kStudioName) return readEnvironment(name_or_path);
    Environment environment = embeddedStudio();
    environment.content_hash = hashOf(environment);
    return environment;
}

}  // namespace peeler
