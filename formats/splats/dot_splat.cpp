// SPDX-License-Identifier: Apache-2.0
// Reader of .splat files (https://github.com/antimatter15/splat): 32 bytes per splat, without a
// header.
#include <cstring>

#include <peeler/error.h>
#include "formats/splats/splat_scene.h"

namespace peeler {
namespace {

/// A splat in the file.
struct DotSplat {
    float mean[3], scale[3];
    std::uint8_t color[4];     ///< red, green, blue, opacity
    std::uint8_t rotation[4];  ///< w, x, y, z: 128 + 128 q
};
static_assert(sizeof(DotSplat) == 32);

Splat splatOf(const DotSplat& from) {
    const auto turn = [&](std::size_t i) { return (from.rotation[i] - 128) / 128.0; };
    Splat splat;
    splat.rotation = {turn(1), turn(2), turn(3), turn(0)};
    splat.opacity = from.color[3] / 255.0;
    for (int i = 0; i < 3; ++i) {
        splat.mean[i] = double{from.mean[i]};
        splat.scale[i] = double{from.scale[i]};
        splat.harmonics[0][i] = harmonicOf(from.color[i] / 255.0);
    }
    return splat;
}

}  // namespace

/// The name says that a file is a .splat. This is whether its content does not contradict.
bool mayBeDotSplat(std::string_view begin, std::uint64_t) {
    for (const std::string_view other : {"ply", "glTF", "\x1f\x8b", "NGSP", "PK\x03\x04"})
        if (begin.starts_with(other)) return false;
    return true;
}

Scene readDotSplat(const std::filesystem::path& path, const SceneReadOptions& options) {
    MeshFile file(path, options);
    const std::span<const std::uint8_t> bytes = file.bytes();
    const std::size_t count = bytes.size() / sizeof(DotSplat),
                      odd = bytes.size() % sizeof(DotSplat);
    if (odd != 0)
        throw Error(ErrorKind::kInput,
                    "the file ends within splat " + std::to_string(count) + ": its size is not a " +
                        "multiple of " + std::to_string(sizeof(DotSplat)) + " bytes",
                    file.atByte(bytes.size()), "copy or export the file again");
    SplatScene scene(file, count, 0);
    for (std::size_t i = 0; i < count; ++i) {
        DotSplat splat;
        std::memcpy(&splat, bytes.data() + i * sizeof splat, sizeof splat);
        scene.add(splatOf(splat));
    }
    return scene.finish();
}

}  // namespace peeler
