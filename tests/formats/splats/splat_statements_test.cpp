// SPDX-License-Identifier: Apache-2.0
// Tests the table for Gaussian splats in formats/README.md, "Supported content".
#include "formats/file/file_statements.h"
#include "formats/meshes/scene_reader.h"
#include "formats/splats/splat_files.h"

namespace peeler::test {
namespace {

constexpr const char* kSplatPly =
    "3DGS PLY: `f_dc_n`, `f_rest_n` (degree 0 to 3), `opacity`, `scale_n`, `rot_n`; "
    "Mip-Splatting's `filter_3D`";
constexpr const char* kSplatChunks = "compressed PLY of PlayCanvas, degree 0 to 3";
constexpr const char* kSplatSpz = "SPZ 2 and 3, degree 0 to 3, also without gzip";
constexpr const char* kSplatDot = "`.splat`, by its name";
constexpr const char* kSplatTraining =
    "comments `SplatRenderMode: mip`, `antialiased 1` and the flag of SPZ: antialiased training";
constexpr const char* kSplatPassedOver = "ignored: normals, other properties and comments";
constexpr const char* kSplatOddValues =
    "splats with non-finite numbers or negative scales (left out), rotations of zeros (not "
    "turned), the comment `SplatRenderMode: 2dgs`";
constexpr const char* kSplatLeftOut =
    "other elements, unknown flags, bytes behind the end, nothing to draw";
constexpr const char* kSplatOtherFormats =
    "SOG, ksplat, other versions of SPZ, its extensions, other gzip";
constexpr const char* kSplatIncomplete =
    "missing properties (2DGS: `scale_2`), other numbers of `f_rest_n`, too few chunks, other "
    "types of packed numbers";
constexpr const char* kSplatBroken =
    "truncation, damaged gzip, SPZ that unpacks to over 200 times its size plus 1 MiB";

TEST(Statements, OfGaussianSplats) {
    const std::vector<Splat> splats = {knownSplat()};
    std::vector<Splat> odd = {knownSplat(), knownSplat(), knownSplat()};
    odd[0].mean.x = std::numeric_limits<double>::infinity();
    std::vector<Splat> unturned = splats;
    unturned[0].rotation = glm::dvec4(0);
    const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
        return text.replace(text.find(from), from.size(), to);
    };
    const auto spz = [&](std::uint32_t version, std::uint8_t flags = 0) {
        return gzip(unpackedSpzOf(splats, 3, version, flags));
    };
    expectStatements(
        "Gaussian splats",
        {
            {kSplatPly, "read", "a.ply", splatPly(splats, 3)},
            {kSplatPassedOver, "read", "a.ply", splatPly(splats, 0, "comment hello\n")},
            {kSplatTraining, "read", "a.ply",
             splatPly(splats, 0, "comment SplatRenderMode: mip\n")},
            {kSplatTraining, "read", "a.ply", splatPly(splats, 0, "comment antialiased 1\n")},
            {kSplatTraining, "read", "a.spz", spz(3, 1)},
            {kSplatOddValues, "warned", "a.ply",
             splatPly(splats, 0, "comment SplatRenderMode: 2dgs\n")},
            {kSplatOddValues, "warned", "a.ply", splatPly(odd, 1)},
            {kSplatOddValues, "warned", "a.splat", dotSplat(odd)},
            {kSplatOddValues, "warned", "a.splat", dotSplat(unturned)},
            {kSplatLeftOut, "warned", "a.ply", splatPly(splats, 0) + "more"},
            {kSplatLeftOut, "warned", "a.ply", splatPly({}, 0)},
            {kSplatLeftOut, "warned", "a.spz", spz(3, 4)},
            {kSplatLeftOut, "warned", "a.ply",
             splatPly(splats, 0, "element camera 0\nproperty float f\n") + "more"},
            {kSplatIncomplete, "refused", "a.ply",
             replaced(splatPly(splats, 0), "scale_2", "other_2")},
            {kSplatIncomplete, "refused", "a.ply",
             replaced(splatPly(splats, 1), "f_rest_8", "other_08")},
            {kSplatBroken, "refused", "a.ply", splatPly(splats, 0).substr(0, 400)},
            {kSplatChunks, "read", "a.ply", compressedPly(splats, 3)},
            {kSplatChunks, "read", "a.ply", compressedPly(splats, 0, false)},
            {kSplatIncomplete, "refused", "a.ply",
             compressedPly(std::vector<Splat>(257, splats[0]), 0)},
            {kSplatIncomplete, "refused", "a.ply",
             replaced(compressedPly(splats, 0), "uint packed", "float packed")},
            {kSplatSpz, "read", "a.spz", spz(2)},
            {kSplatSpz, "read", "a.spz", spz(3)},
            {kSplatSpz, "read", "a.spz", unpackedSpzOf(splats, 0, 3)},
            {kSplatOtherFormats, "refused", "a.spz", spz(4)},
            {kSplatOtherFormats, "refused", "a.spz", spz(3, 2)},
            {kSplatOtherFormats, "refused", "a.spz", gzip("Once upon a time")},
            {kSplatOtherFormats, "refused", "a.sog", "PK\x03\x04"},
            {kSplatBroken, "refused", "a.spz", spz(3).substr(0, 50)},
            {kSplatBroken, "refused", "a.spz", gzip(std::string(std::size_t{4} << 20U, '\0'))},
            {kSplatDot, "read", "a.splat", dotSplat(splats)},
            {kSplatBroken, "refused", "a.splat", dotSplat(splats).substr(1)},
        },
        [](const std::filesystem::path& file, bool strict) {
            SceneReadOptions options;
            options.strict = strict;
            return readSceneFile(file, options).warnings;
        });
}

}  // namespace
}  // namespace peeler::test
