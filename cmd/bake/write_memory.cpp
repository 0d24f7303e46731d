// SPDX-License-Identifier: Apache-2.0
#include "cmd/bake/write_memory.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "formats/exr/exr_layout.h"
#include "formats/gltf/glb_writer.h"
#include "formats/image/image_library.h"

namespace peeler::cmd {

namespace {

// Bytes for the file's buffer, and for code pages first touched while writing.
constexpr std::uint64_t kWritingBytes = std::uint64_t{4} << 20;

/// The memory for textures of `texels` texels with `components` components each. `kept` textures
/// are in memory at the same time.
struct Textures {
    std::uint64_t texels, components, kept;

    std::uint64_t numbers() const { return texels * components * sizeof(float); }
    /// Returns the bytes needed while filling a texture (TexelReceivers::pixels()). Each texel
    /// needs a flag, and the distance and index of the nearest filled texel in its column.
    std::uint64_t filling() const {
        return kept * numbers() + texels * (1 + 2 * sizeof(std::int32_t));
    }
    /// Returns the bytes needed while encoding a PNG with `bytes` bytes per value: the values, the
    /// rows, and the compressed data, which is in memory twice while its buffer grows.
    std::uint64_t png(std::uint64_t bytes) const {
        const std::uint64_t picture = texels * components * bytes;
        return numbers() + 3 * picture + imageEncoderBytes("png", picture);
    }
    /// Returns the bytes needed while writing an EXR: the kept textures, the compressed chunks of
    /// one texture, and the chunks being compressed.
    std::uint64_t exr(std::uint64_t side) const {
        const std::uint64_t chunk = side * kExrRowsPerChunk * components * sizeof(float);
        return (kept + 1) * numbers() + 2 * chunk * static_cast<std::uint64_t>(threadCount());
    }
};

}  // namespace

std::uint64_t writeMemory(const BakeOptions& bake, const SceneOptions& options,
                          const OpenedScene& scene, std::uint64_t receivers,
                          const TexelReceivers* texels) {
    const std::uint64_t components = componentsOf(bake.settings.quantity);
    std::uint64_t bytes = kWritingBytes, package = 0;
    if (bake.file() == BakeFile::kGltf)
        package = scene.assumed()
                      ? GlbWriter::memory(scene.scene())
                      : GlbWriter::memory(options.file, options.reading, scene.scene().files);
    if (!texels && bake.file() == BakeFile::kArrays) return bytes;
    if (!texels) {
        // COLOR_0 and the values are in memory twice: once in the baked primitives and once in the
        // file.
        constexpr std::uint64_t kColorBytes = 4 * sizeof(std::uint16_t);
        return bytes + package + 2 * receivers * (kColorBytes + components * sizeof(float));
    }
    const auto side = static_cast<std::uint64_t>(texels->settings().size);
    const auto atlases = static_cast<std::uint64_t>(texels->atlases().size());
    Textures textures{side * side, components, 1};
    if (bake.file() == BakeFile::kExr) {
        textures.kept = atlases;
        return bytes + std::max(textures.filling(), textures.exr(side));
    }
    if (bake.file() == BakeFile::kPng)
        return bytes + std::max(textures.filling(), textures.png(sizeof(std::uint16_t)));
    if (bake.file() == BakeFile::kArrays) return bytes + textures.filling();
    const std::uint64_t encoded = atlases * textures.texels;  // at most one byte per texel
    bytes += encoded;
    return bytes + std::max({textures.filling(), textures.png(1), package});
}

}  // namespace peeler::cmd
