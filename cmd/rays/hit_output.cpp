// SPDX-License-Identifier: Apache-2.0
// The table of files that hold hits.
#include "cmd/rays/hit_output.h"

#include <filesystem>

#include "core/base/error.h"
#include "formats/file/file_extension.h"

namespace peeler::cmd {

namespace {

/// One row.
struct HitFormat {
    std::string_view extension;  ///< lower case
    std::unique_ptr<RayOutput> (*make)(std::string path, const HitSources& sources,
                                       bool double_positions);
};

constexpr HitFormat kFormats[] = {
    {".npz", [](std::string path, const HitSources& sources,
                bool) { return makeHitArrays(std::move(path), sources); }},
    {".ply", makeHitPoints},
    {".exr", [](std::string path, const HitSources& sources,
                bool) { return makeHitImage(std::move(path), sources); }},
};

const HitFormat& formatOf(const std::string& path) {
    for (const HitFormat& format : kFormats)
        if (hasExtension(path, format.extension)) return format;
    throw Error(ErrorKind::kUsage, "hits cannot be written in this format", path,
                "end the name in .npz, .ply or .exr; --map writes pictures");
}

}  // namespace

bool hasExtension(const std::filesystem::path& path, std::string_view extension) {
    return lowerExtension(path) == extension;
}

void checkHitFormat(const std::string& path) {
    formatOf(path);
}

std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitSources& sources,
                                         bool double_positions) {
    return formatOf(path).make(path, sources, double_positions);
}

}  // namespace peeler::cmd
