// SPDX-License-Identifier: Apache-2.0
// The table of hit formats; the extension chooses the format.
#include <string_view>

#include <peeler/error.h>
#include "formats/file/file_name.h"
#include "formats/rays/hit_columns.h"
#include "formats/rays/ray_output.h"

namespace peeler {
namespace {

/// A format for hits, and the function that makes its output.
struct HitFormat {
    std::string_view extension;  ///< extension in lower case
    std::unique_ptr<RayOutput> (*make)(const std::string& path, const HitOptions& options);
};

constexpr HitFormat kHitFormats[] = {
    {".npz", makeHitArrays},
    {".safetensors", makeHitArrays},
    {".ply", makeHitPoints},
    {".exr", makeHitImage},
};

const HitFormat& hitFormatOf(const std::string& path) {
    const std::string extension = lowerExtension(path);
    for (const HitFormat& format : kHitFormats)
        if (format.extension == extension) return format;
    throw Error(ErrorKind::kUsage, "hits cannot be written in this format", path,
                "end the name in .npz, .safetensors, .ply or .exr; " + Parameter::kMaps +
                    " writes pictures");
}

}  // namespace

void checkHitFormat(const std::string& path) {
    hitFormatOf(path);
}

std::uint64_t raysOf(std::span<const Bundle> bundles) {
    std::uint64_t rays = 0;
    for (const Bundle& bundle : bundles)
        rays += bundle.rays();
    return rays;
}

std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitOptions& options) {
    const HitFormat& format = hitFormatOf(path);
    if (!options.dense) return format.make(path, options);
    if (format.make != makeHitArrays)
        throw Error(ErrorKind::kUsage, "only arrays have planes", path,
                    "end the name in .npz or .safetensors");
    return makeHitPlanes(path, options);
}

}  // namespace peeler
