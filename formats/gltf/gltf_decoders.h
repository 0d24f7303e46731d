// SPDX-License-Identifier: Apache-2.0
// Decoders of compressed glTF data: meshes (Draco), buffer views (meshopt) and textures. They are
// independent of glTF's JSON, thread-safe, and throw Error (kInput) with an empty `where`.
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

/// Upper limits of the decoded mesh. Larger meshes are rejected, before allocation where the data
/// declares its size.
struct DracoLimits {
    std::uint64_t faces = 0, points = 0;
    int cpu_seconds = 10;
    /// Decoder memory beyond dracoBytes().
    std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Returns the CPU time limit for a number of triangles: a million take about one second.
constexpr int dracoSeconds(std::uint64_t faces) {
    constexpr std::uint64_t kFacesASecond = 250'000, kMostSeconds = 1000;
    return 1 + static_cast<int>(std::min(faces / kFacesASecond, kMostSeconds));
}

/// Returns the memory limit: about 200 bytes per triangle while the connectivity is decoded,
/// several copies of the attribute values, and the result with its copy.
constexpr std::uint64_t dracoBytes(std::uint64_t faces, std::size_t attributes) {
    return (std::uint64_t{256} << 20) + faces * (512 + std::uint64_t{192} * attributes);
}

inline constexpr char kDracoHint[] = "compress the file again";

struct DracoMesh {
    std::vector<std::uint32_t> indices;  ///< three per triangle, all below `points`
    std::size_t points = 0;
    /// In the requested order: points · components values each, tightly packed.
    std::vector<std::vector<std::uint8_t>> attributes;
};

/// Decodes a triangle mesh (sequential or Edgebreaker; a strip too is decoded to triangles).
/// libdraco 1.5.5 reads 2^31 bits of orientations if one byte of a few thousand vertices is wrong,
/// so it runs in a separate process, peeler_decode, whose time and memory are limited in proportion
/// to the declared counts and by `limits`. Adds the CPU time used, in microseconds, to `used`.
/// Throws Error (kMemory) if the data may be valid but `limits.bytes` is too small, and Error
/// (kInternal) if peeler_decode is not installed.
DracoMesh decodeDracoMesh(std::span<const std::uint8_t> bytes,
                          std::span<const DracoAttribute> attributes, const DracoLimits& limits,
                          std::atomic<std::uint64_t>* used = nullptr);

/// Reads the mesh from a decoder's result, which is checked like an input file: hostile data may
/// control the decoder. Throws Error (kInput) if counts exceed `limits`, if an index or an
/// attribute does not match them, or if there is no triangle.
DracoMesh takeDracoMesh(SharedFile& result, std::span<const DracoAttribute> attributes,
                        const DracoLimits& limits);

// meshopt_view.cpp: EXT_meshopt_compression and KHR_meshopt_compression.

/// The properties of a compressed stream, as in the extension object.
struct MeshoptStream {
    std::span<const std::uint8_t> bytes;  ///< the compressed ones
    std::string mode;                     ///< ATTRIBUTES, TRIANGLES, INDICES
    std::string filter = "NONE";          ///< NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL, COLOR
    std::uint64_t stride = 0;             ///< bytes per element
    std::uint64_t count = 0;              ///< elements
};

/// Checks the extension's rules ("for the extension object to be valid …") and that the element
/// count is plausible for the compressed size: the formats need at least 1/64 of the decoded size
/// (and one byte per triangle or index). So a declared size is checked before its memory is
/// allocated.
void checkMeshoptStream(const MeshoptStream& stream);

/// Decodes a checked stream into `out`, which has count · stride bytes.
void decodeMeshoptStream(const MeshoptStream& stream, std::span<std::uint8_t> out);

// texture_decoder.cpp: PNG, JPEG, WebP and KTX2; also BMP, TIFF and TGA, which MTL files use.

struct TextureLimits {
    int max_dimension = 16384;                         ///< width and height, pixels
    std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< decoded, 4 bytes per pixel
    /// Called with the number of bytes before they are allocated; may throw.
    std::function<void(std::uint64_t bytes)> allow{};
};

struct DecodedTexture {
    Image image;
    bool in_gltf = true;         ///< the format is part of glTF 2.0 or its extensions
    std::optional<bool> srgb{};  ///< colour space declared by the file; false: linear
    /// Defects of the file and features that are not shown, a clause each, as in StoredImage.
    std::vector<std::string> notes{};
};

/// Decodes a picture to 8-bit RGBA with straight alpha, values as stored (no colour conversion, no
/// orientation). Grey becomes R = G = B, missing alpha becomes 255, 16 bits are rounded to 8. The
/// format is recognised by the first bytes; only the formats above reach a decoder.
DecodedTexture decodeTexture(std::span<const std::uint8_t> bytes, const std::string& name,
                             const TextureLimits& limits = {});

}  // namespace peeler
