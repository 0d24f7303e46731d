// SPDX-License-Identifier: Apache-2.0
// Decoders of what a glTF file has compressed in it: meshes (Draco), buffer views (meshopt) and
// textures. They know nothing of glTF's JSON, may be called from several threads, and throw
// Error(kInput) with an empty `where`.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>

namespace peeler {

class SharedFile;

// draco_mesh.cpp.

/// An attribute as a glTF accessor describes it.
struct DracoAttribute {
    std::uint32_t unique_id = 0;  ///< in the compressed data
    int component_type = 5126;    ///< glTF's number, 5120 BYTE … 5126 FLOAT
    int components = 1;
};

/// What may come out at most; more is refused, before memory is allocated for it where the data
/// says it in advance.
struct DracoLimits {
    std::uint64_t faces = 0, points = 0;
    int cpu_seconds = 10;
    /// Of the decoder's memory, besides what dracoBytes() says.
    std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
};

/// The processor time that decoding so many triangles may take: a million take about one second.
constexpr int dracoSeconds(std::uint64_t faces) {
    constexpr std::uint64_t kFacesASecond = 250'000, kMostSeconds = 1000;
    return 1 + static_cast<int>(std::min(faces / kFacesASecond, kMostSeconds));
}

/// The memory that it may take: some 200 bytes a triangle while its connectivity is decoded, its
/// values several times over, and the result with its copy.
constexpr std::uint64_t dracoBytes(std::uint64_t faces, std::size_t attributes) {
    return (std::uint64_t{256} << 20) + faces * (512 + std::uint64_t{192} * attributes);
}

inline constexpr char kDracoHint[] = "compress the file again";

struct DracoMesh {
    std::vector<std::uint32_t> indices;  ///< three a triangle, all below `points`
    std::size_t points = 0;
    /// In the order they were asked for: points · components numbers, tightly packed.
    std::vector<std::vector<std::uint8_t>> attributes;
};

/// Decodes a triangle mesh (sequential or Edgebreaker; a strip is decoded to its triangles too).
/// libdraco 1.5.5 reads 2^31 bits of orientations where one byte of a few thousand vertices is
/// wrong, so it runs in a program of its own, peeler_decode, which may take time and memory in
/// proportion to what is promised, and no more than the limits; the microseconds of processor time
/// that it takes are added to `used`. Throws Error (kMemory) where the data may be sound but
/// `limits.bytes` are too few, (kInternal) if peeler_decode is not installed.
DracoMesh decodeDracoMesh(std::span<const std::uint8_t> bytes,
                          std::span<const DracoAttribute> attributes, const DracoLimits& limits,
                          std::atomic<std::uint64_t>* used = nullptr);

/// The mesh that a decoder's result holds, checked as if it were the file: hostile data may
/// control the decoder. Throws Error (kInput) for counts over `limits`, a corner or an attribute
/// that does not fit them, and no triangle.
DracoMesh takeDracoMesh(SharedFile& result, std::span<const DracoAttribute> attributes,
                        const DracoLimits& limits);

// meshopt_view.cpp: EXT_meshopt_compression and KHR_meshopt_compression.

/// What the extension object says of a compressed stream, in its own words.
struct MeshoptStream {
    std::span<const std::uint8_t> bytes;  ///< the compressed ones
    std::string mode;                     ///< ATTRIBUTES, TRIANGLES, INDICES
    std::string filter = "NONE";          ///< NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL, COLOR
    std::uint64_t stride = 0;             ///< bytes of an element
    std::uint64_t count = 0;              ///< elements
};

/// Checks the rules of the extension ("for the extension object to be valid …") and that so many
/// elements can be in so few bytes: the formats spend at least a 64th of what they decode to (and a
/// byte for each triangle or index), so that a promise is judged before memory is allocated for it.
void checkMeshoptStream(const MeshoptStream& stream);

/// Decodes a stream that has passed the check into `out`, which has count · stride bytes.
void decodeMeshoptStream(const MeshoptStream& stream, std::span<std::uint8_t> out);

// texture_decoder.cpp: PNG, JPEG, WebP and KTX2; and BMP, TIFF and TGA, which MTL files name.

struct TextureLimits {
    int max_dimension = 16384;                         ///< width and height, pixels
    std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< decoded, 4 bytes a pixel
    /// Told how many bytes will be allocated, before they are; may throw.
    std::function<void(std::uint64_t bytes)> allow{};
};

struct DecodedTexture {
    Image image;
    bool in_gltf = true;         ///< the format is one that glTF 2.0 or its extensions have
    std::optional<bool> srgb{};  ///< what the file says of its colours; false: they are linear
    /// What is wrong with the file or not shown of it, each a clause, as StoredImage has them.
    std::vector<std::string> notes{};
};

/// The picture as 8-bit RGBA with straight alpha, numbers as stored (no colour conversion, no
/// orientation). Grey becomes R = G = B, no alpha becomes 255, 16 bits are rounded to 8. The format
/// is told by the first bytes; nothing but the formats above is handed to a decoder.
DecodedTexture decodeTexture(std::span<const std::uint8_t> bytes, const std::string& name,
                             const TextureLimits& limits = {});

}  // namespace peeler
