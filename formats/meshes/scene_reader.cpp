// SPDX-License-Identifier: Apache-2.0
#include "formats/meshes/scene_reader.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <peeler/error.h>
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/file/text_words.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/meshes/mesh_parts.h"
#include "formats/meshes/ply_elements.h"

namespace peeler {
namespace {

/// The number of bytes from which the format of a file is recognised.
constexpr std::size_t kBegin = 4096;

constexpr std::string_view kGltfExtensions[] = {".gltf", ".glb"}, kPlyExtensions[] = {".ply"},
                           kStlExtensions[] = {".stl"}, kObjExtensions[] = {".obj"},
                           kThreeMfExtensions[] = {".3mf"},
                           kArrayExtensions[] = {".npz", ".safetensors"},
                           kSpzExtensions[] = {".spz"}, kDotSplatExtensions[] = {".splat"};

constexpr SceneFormat kSceneFormats[] = {
    {"glTF", kGltfExtensions,
     [](std::string_view begin, std::uint64_t size) {
         // A .safetensors may also begin with a brace: the first byte of its header's length.
         return begin.starts_with("glTF") ||
                (trimmed(withoutByteOrderMark(begin)).starts_with('{') &&
                 !isSafetensors(begin, size));
     },
     [](const std::filesystem::path& path, const SceneReadOptions& options) {
         return readGltf(path, options);
     },
     false, "a glTF has +Y up, units of metres and its own normals", true},
    {"arrays", kArrayExtensions, isArrayScene, readArrayScene, true},
    // The other forms of PLY come first. Files that no row recognises go by extension to PLY.
    {"3DGS PLY", {}, isSplatPly, readSplatPly},
    {"compressed PLY", {}, isCompressedSplatPly, readCompressedSplatPly},
    {"PLY", kPlyExtensions, [](std::string_view begin, std::uint64_t) { return isPly(begin); },
     readPlyScene},
    {"STL", kStlExtensions, isStl, readStlScene},
    {"OBJ", kObjExtensions, isObj, readObjScene},
    {"3MF", kThreeMfExtensions, isThreeMf, readThreeMfScene, false,
     "a 3MF has +Z up, and names its unit", false, true},
    {"SPZ", kSpzExtensions, isSpz, readSpz},
    {".splat", kDotSplatExtensions, mayBeDotSplat, readDotSplat, false, nullptr, false, false,
     true},
};

/// A kind of file that is not a scene, recognised by its first bytes.
struct NoScene {
    std::string_view begin;
    const char *what, *hint;
};
constexpr const char* kUtf16 = "it is text in UTF-16";
constexpr const char* kUtf16Hint =
    "save it as UTF-8; in PowerShell, Set-Content -Encoding utf8 does, and > does not";
constexpr NoScene kNoScenes[] = {
    {"\xFF\xFE", kUtf16, kUtf16Hint},
    {"\xFE\xFF", kUtf16, kUtf16Hint},
    {"version https://git-lfs.github.com/spec/", "it is a Git LFS pointer, not the file itself",
     "fetch it: git lfs pull"},
    {"<!DOCTYPE", "it is a web page", "download the file itself"},
    {"<html", "it is a web page", "download the file itself"},
};

bool hasExtension(const SceneFormat& format, const std::filesystem::path& path) {
    return std::ranges::find(format.extensions, lowerExtension(path)) != format.extensions.end();
}

const SceneFormat* formatNamed(const std::filesystem::path& path) {
    const auto* const format = std::ranges::find_if(kSceneFormats, [&](const SceneFormat& row) {
        return !row.by_content && hasExtension(row, path);
    });
    return format == std::end(kSceneFormats) ? nullptr : format;
}

std::string_view readBegin(const RegularFile& file, std::array<char, kBegin>& bytes) {
    file.check();
    return {bytes.data(), file.readSome(0, bytes)};
}

/// A format of splats that is not read, recognised by the name of the file.
struct OtherSplats {
    std::string_view end;
    const char* name;
};
constexpr OtherSplats kOtherSplats[] = {{".sog", "SOG"}, {".ksplat", "ksplat"}};

/// Returns the format of the content, or, if no format recognises it, the format of the name.
/// Throws Error (kInput) if the content is certainly something else.
const SceneFormat* formatOf(const std::filesystem::path& path) {
    for (const OtherSplats& row : kOtherSplats)
        if (lowerExtension(path) == row.end)
            throw Error(ErrorKind::kInput, std::string(row.name) + " splats are not supported",
                        path.string(), "convert them to PLY, SPZ 3 or glTF");
    if (const SceneFormat* const format = sceneFormatOf(path)) return format;
    std::array<char, kBegin> bytes{};
    const std::string_view begin = readBegin(RegularFile(path), bytes);
    for (const NoScene& row : kNoScenes)
        if (begin.starts_with(row.begin))
            throw Error(ErrorKind::kInput, std::string("this is not a scene: ") + row.what,
                        path.string(), row.hint);
    return formatNamed(path);
}

/// Warns of options for properties that the format defines.
void checkUnused(const SceneFormat& format, const std::filesystem::path& path,
                 const SceneReadOptions& options, Scene& scene) {
    if (!options.up && !options.metres_per_unit && !(format.has_normals && options.smooth_normals))
        return;
    const Text names = format.has_normals ? Parameter::kUp + ", " + Parameter::kMetresPerUnit +
                                                " and " + Parameter::kSmoothNormals
                                          : Parameter::kUp + " and " + Parameter::kMetresPerUnit;
    const Text why = names + " are for PLY, STL and OBJ: " + format.defines;
    if (options.strict) throw Error(ErrorKind::kUsage, why, path.string());
    scene.warnings.push_back(why + ".");
}

void checkOptions(const SceneReadOptions& options) {
    const auto metres = options.metres_per_unit.value_or(1);
    if (!(metres > 0 && std::isfinite(metres)))
        throw Error(ErrorKind::kUsage, "a unit must be longer than 0", Parameter::kMetresPerUnit);
    const double degrees = options.smooth_normals.value_or(0);
    if (!(degrees >= 0 && degrees <= 180))
        throw Error(ErrorKind::kUsage, "expected an angle from 0 to 180 degrees",
                    Parameter::kSmoothNormals);
}

}  // namespace

glm::dmat4 placeOf(Axis up, double unit) {
    const glm::dvec4 x(unit, 0, 0, 0), y(0, unit, 0, 0), z(0, 0, unit, 0), end(0, 0, 0, 1);
    switch (up) {
        case Axis::kX:
            return {y, -x, z, end};
        case Axis::kY:
            break;
        case Axis::kZ:
            return {x, -z, y, end};
    }
    return {x, y, z, end};
}

std::span<const SceneFormat> sceneFormats() {
    return kSceneFormats;
}

std::string sceneExtensions(bool by_name) {
    std::string all;
    for (const SceneFormat& format : kSceneFormats)
        for (const std::string_view extension : format.extensions)
            if (!(by_name && format.by_content))
                all.append(all.empty() ? "" : " ").append(extension);
    return all;
}

bool namesUnit(const std::filesystem::path& path) {
    const SceneFormat* const format = sceneFormatOf(path);
    return format && format->names_unit;
}

bool isSceneName(const std::filesystem::path& path) {
    return formatNamed(path) != nullptr;
}

const SceneFormat* sceneFormatOf(const std::filesystem::path& path) {
    const RegularFile file(path);
    std::array<char, kBegin> bytes{};
    const std::string_view begin = readBegin(file, bytes);
    for (const bool by_name : {true, false})
        for (const SceneFormat& row : kSceneFormats)
            if (row.by_name == by_name && (!by_name || hasExtension(row, path)) &&
                row.recognises(begin, file.size()))
                return &row;
    return nullptr;
}

std::optional<Assumed> assumedOf(const std::filesystem::path& path,
                                 const SceneReadOptions& options) {
    const SceneFormat* const format = formatOf(path);
    if (!format || format->defines) return {};
    return Assumed{format->name, options.up.value_or(Axis::kY),
                   options.metres_per_unit.value_or(1)};
}

Scene readSceneFile(const std::filesystem::path& path, const SceneReadOptions& options) {
    checkOptions(options);
    const SceneFormat* const format = formatOf(path);
    if (!format)
        throw Error(
            ErrorKind::kInput, "unknown scene format", path.string(),
            "give glTF, PLY, STL, OBJ, 3MF, SPZ, .splat or arrays; except .splat, the format is "
            "recognised by content");
    Scene scene;
    try {
        scene = format->read(path, options);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to read the scene", path.string());
    }
    if (format->defines) {
        checkUnused(*format, path, options, scene);
        return scene;
    }
    const glm::dmat4 place =
        placeOf(options.up.value_or(Axis::kY), options.metres_per_unit.value_or(1));
    for (const int root : scene.scenes.front().roots) {
        glm::dmat4& local = scene.nodes[static_cast<std::size_t>(root)].local;
        local = place * local;
    }
    return scene;
}

}  // namespace peeler
