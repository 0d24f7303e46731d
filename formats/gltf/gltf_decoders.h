// SPDX-License-Identifier: Apache-2.0
// Decoders of compressed glTF data: meshes (Draco), buffer views (meshopt) and textures.
//
// They do not depend on glTF's JSON, are thread-safe, and throw Error (kInput) with an empty
// `where`.
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

// Defined in draco_mesh.cpp.

/// A compressed attribute, as described by its glTF accessor.
struct DracoAttribute {
    std::uint32_t unique_id = 0;  ///< id of the attribute in the compressed data
    int component_type = 5126;    ///< type as in glTF: 5120 BYTE … 5126 FLOAT
    int components = 1;
};

/// The maximum size of a decoded mesh. Larger meshes are rejected, before any allocation if the
/// data declares the mesh's size.
struct DracoLimits {
    std::uint64_t faces = 0, points = 0;
    int cpu_seconds = 10;
    /// Memory that the decoder may use in addition to dracoBytes().
    std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Returns the limit on CPU time, in seconds, for a number of triangles. A million triangles take
/// about one second in practice.
constexpr int dracoSeconds(std::uint64_t faces) {
    constexpr std::uint64_t kFacesASecond = 250'000, kMostSeconds = 1000;
    return 1 + static_cast<int>(std::min(faces / kFacesASecond, kMostSeconds));
}

/// Returns the limit on the decoder's memory, in bytes. The decoder needs about 200 bytes per
/// triangle for the connectivity, several copies of the attribute values, and two copies of the
/// result.
constexpr std::uint64_t dracoBytes(std::uint64_t faces, std::size_t attributes) {
    return (std::uint64_t{256} << 20) + faces * (512 + std::uint64_t{192} * attributes);
}

inline constexpr char kDracoHint[] = "compress the file again";

struct DracoMesh {
    std::vector<std::uint32_t> indices;  ///< three indices per triangle, all below `points`
    std::size_t points = 0;
    /// For each requested attribute, in order: points · components values, without padding.
    std::vector<std::vector<std::uint8_t>> attributes;
};

/// Decodes a triangle mesh (sequential or Edgebreaker). Strips become triangles. Adds the CPU time
/// used, in microseconds, to `used`. Throws Error (kMemory) if `limits.bytes` is too small for data
/// that may be valid, Error (kInternal) if peeler_decode is not installed.
///
/// A single wrong byte in a few thousand vertices may make libdraco 1.5.5 read 2^31 bits of
/// orientations. So libdraco runs in a separate process, peeler_decode, whose limits on time and
/// memory derive from the declared counts and `limits`.
DracoMesh decodeDracoMesh(std::span<const std::uint8_t> bytes,
                          std::span<const DracoAttribute> attributes, const DracoLimits& limits,
                          std::atomic<std::uint64_t>* used = nullptr);

/// Reads the mesh from a decoder's result. Hostile data may have taken control of the decoder, so
/// the result is checked like an input file. Throws Error (kInput) if counts exceed `limits`, if an
/// index or an attribute does not match the counts, or if there is no triangle.
DracoMesh takeDracoMesh(SharedFile& result, std::span<const DracoAttribute> attributes,
                        const DracoLimits& limits);

// Defined in meshopt_view.cpp: EXT_meshopt_compression and KHR_meshopt_compression.

/// A compressed stream, with its properties from the extension object.
struct MeshoptStream {
    std::span<const std::uint8_t> bytes;  ///< compressed bytes
    std::string mode;                     ///< ATTRIBUTES, TRIANGLES or INDICES
    std::string filter = "NONE";          ///< NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR
    std::uint64_t stride = 0;             ///< bytes per element
    std::uint64_t count = 0;              ///< number of elements
};

/// Checks the extension's rules ("for the extension object to be valid …"), and that the compressed
/// bytes suffice for the declared number of elements: at least 1/64 of the decoded size, or one
/// byte per triangle or index. Memory of the declared size may be allocated only after this check.
void checkMeshoptStream(const MeshoptStream& stream);

/// Decodes a stream that passed checkMeshoptStream() into `out`, which has count · stride bytes.
void decodeMeshoptStream(const MeshoptStream& stream, std::span<std::uint8_t> out);

// Defined in texture_decoder.cpp: PNG, JPEG, WebP and KTX2; also BMP, TIFF and TGA, which MTL files
// use.

struct TextureLimits {
    int max_dimension = 16384;  ///< maximum width and height, in pixels
    /// Maximum decoded size in bytes, at 4 bytes per pixel.
    std::uint64_t max_bytes = std::uint64_t{1} << 30;
    /// Called before each allocation with its size; may throw.
    std::function<void(std::uint64_t bytes)> allow{};
};

struct DecodedTexture {
    Image image;
    bool in_gltf = true;  ///< whether the format is part of glTF 2.0 or an extension
    /// Whether the file declares its values as sRGB (true) or linear (false).
    std::optional<bool> srgb{};
    /// Defects and unsupported features of the file, phrased like StoredImage::notes.
    std::vector<std::string> notes{};
};

/// Decodes a picture to 8-bit RGBA with straight alpha. Values stay as stored: colour space and
/// orientation are not converted. Grey becomes R = G = B, missing alpha becomes 255, and 16 bits
/// are rounded to 8. The first bytes determine the format; files in unknown formats reach no
/// decoder.
DecodedTexture decodeTexture(std::span<const std::uint8_t> bytes, const std::string& name,
                             const TextureLimits& limits = {});

}  // namespace peeler
