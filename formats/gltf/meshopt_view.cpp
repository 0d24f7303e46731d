// SPDX-License-Identifier: Apache-2.0
// Decoder of meshopt-compressed buffer views (EXT_meshopt_compression, KHR_meshopt_compression).
#include "formats/gltf/gltf_decoders.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include <peeler/error.h>

namespace peeler {
namespace {

[[noreturn]] void failMeshopt(const std::string& what,
                              const char* hint = "compress the file again") {
    throw Error(ErrorKind::kInput, what, "", hint);
}

constexpr std::uint64_t kGroup = 16;  // elements per group in the attribute codec

/// Returns the minimum size in mode 0 (Appendix A of the extension). Blocks have at most 8 KiB and
/// 256 elements, and take at least two bits per group for every byte of an element. A tail follows,
/// which holds the first element.
std::uint64_t leastAttributeBytes(std::uint64_t count, std::uint64_t stride) {
    const std::uint64_t block = std::min<std::uint64_t>(8192 / stride / kGroup * kGroup, 256);
    const auto headers = [&](std::uint64_t elements) {
        return stride * (((elements + kGroup - 1) / kGroup + 3) / 4);
    };
    return 1 + count / block * headers(block) + headers(count % block) +
           std::max<std::uint64_t>(stride, 32);
}

/// Returns the minimum size in mode 1: a header, a byte per triangle, and a table of 16 bytes.
std::uint64_t leastTriangleBytes(std::uint64_t count, std::uint64_t) {
    return 1 + count / 3 + 16;
}

/// Returns the minimum size in mode 2: a header, a byte per index, and four bytes of padding.
std::uint64_t leastIndexBytes(std::uint64_t count, std::uint64_t) {
    return 1 + count + 4;
}

struct Mode {
    const char* name;
    std::uint8_t header;   ///< high half of the first byte; identifies the codec
    std::uint8_t version;  ///< newest version that the library decodes
    std::uint64_t (*least_bytes)(std::uint64_t count, std::uint64_t stride);
    /// Decodes the stream. Returns 0 if the stream is valid.
    int (*decode)(void* out, std::size_t count, std::size_t stride, const unsigned char* bytes,
                  std::size_t size);
};

constexpr Mode kModes[] = {
    {"ATTRIBUTES", 0xA0, 0, leastAttributeBytes, meshopt_decodeVertexBuffer},
    {"TRIANGLES", 0xE0, 1, leastTriangleBytes, meshopt_decodeIndexBuffer},
    {"INDICES", 0xD0, 1, leastIndexBytes, meshopt_decodeIndexSequence},
};

/// Decodes filter 4 of KHR_meshopt_compression (Appendix B): YCoCg with K bits, and an alpha whose
/// highest set bit encodes K. The meshopt library lacks this filter before version 0.25.
template <typename Unsigned, typename Signed>
void decodeColors(std::uint8_t* bytes, std::size_t count) {
    constexpr int kMax = std::numeric_limits<Unsigned>::max();
    for (std::size_t i = 0; i < count; ++i, bytes += 4 * sizeof(Unsigned)) {
        Unsigned in[4];
        std::memcpy(in, bytes, sizeof in);
        int full = in[3];  // the loop turns this into K set bits
        for (const int shift : {1, 2, 4, 8})
            full |= full >> shift;
        const int y = in[0], co = int{static_cast<Signed>(in[1])},
                  cg = int{static_cast<Signed>(in[2])};
        const int alpha = in[3] & (full >> 1);
        const float scale = static_cast<float>(kMax) / static_cast<float>(std::max(full, 1));
        const auto stored = [&](int value) {
            const float rounded = std::round(static_cast<float>(value) * scale);
            return static_cast<Unsigned>(std::clamp(rounded, 0.0F, static_cast<float>(kMax)));
        };
        const Unsigned out[4] = {stored(y + co - cg), stored(y + cg), stored(y - co - cg),
                                 stored(alpha << 1 | (alpha & 1))};
        std::memcpy(bytes, out, sizeof out);
    }
}

void decodeColorFilter(void* bytes, std::size_t count, std::size_t stride) {
    auto* first = static_cast<std::uint8_t*>(bytes);
    if (stride == 4)
        decodeColors<std::uint8_t, std::int8_t>(first, count);
    else
        decodeColors<std::uint16_t, std::int16_t>(first, count);
}

struct Filter {
    const char* name;
    bool any_stride;  ///< if false, `four` and `eight` are the allowed strides
    bool four, eight;
    void (*decode)(void* bytes, std::size_t count, std::size_t stride);
};

// The meshopt library decodes OCTAHEDRAL and QUATERNION with estimated square roots, whose bits
// differ between processors. So these functions replace it.

/// Returns the nearest integer, of which the file keeps the low bits.
template <typename Signed>
Signed rounded(float value) {
    return static_cast<Signed>(std::lrint(value));
}

/// Decodes octahedral normals and tangents (EXT_meshopt_compression, Appendix A, filter 1).
template <typename Signed>
void decodeDirections(std::uint8_t* bytes, std::size_t count) {
    constexpr auto kOne = static_cast<float>(std::numeric_limits<Signed>::max());
    for (std::size_t i = 0; i < count; ++i, bytes += 4 * sizeof(Signed)) {
        Signed v[4];
        std::memcpy(v, bytes, sizeof v);
        // The third component is 1 in the same precision. Its highest bit has no meaning in 16
        // bits.
        const int one = sizeof(Signed) == 1 ? v[2] : v[2] & std::numeric_limits<Signed>::max();
        float x = v[0], y = v[1];
        const float z = static_cast<float>(one) - (std::abs(x) + std::abs(y));
        const float fold = std::min(z, 0.0F);  // the lower half lies in the corners
        x += x < 0 ? -fold : fold;
        y += y < 0 ? -fold : fold;
        const float length = std::sqrt(x * x + (y * y + z * z));
        const float scale = length > 0 ? kOne / length : 0;
        v[0] = rounded<Signed>(x * scale);
        v[1] = rounded<Signed>(y * scale);
        v[2] = rounded<Signed>(z * scale);
        std::memcpy(bytes, v, sizeof v);
    }
}

void decodeOctahedralFilter(void* data, std::size_t count, std::size_t stride) {
    const auto decode =
        stride == 4 ? decodeDirections<std::int8_t> : decodeDirections<std::int16_t>;
    decode(static_cast<std::uint8_t*>(data), count);
}

/// Decodes rotations (the same, filter 2).
void decodeQuaternionFilter(void* data, std::size_t count, std::size_t) {
    const float half = 1 / std::sqrt(2.0F);
    auto* bytes = static_cast<std::uint8_t*>(data);
    for (std::size_t i = 0; i < count; ++i, bytes += 8) {
        std::int16_t v[4];
        std::memcpy(v, bytes, sizeof v);
        // The low bits of the last component are the index of the largest one.
        const auto largest = static_cast<std::size_t>(v[3] & 3);
        const float scale = half / static_cast<float>(v[3] | 3);
        const float x = static_cast<float>(v[0]) * scale, y = static_cast<float>(v[1]) * scale,
                    z = static_cast<float>(v[2]) * scale;
        const float w = std::sqrt(std::max(1 - (x * x + (y * y + z * z)), 0.0F));
        const float parts[] = {w, x, y, z};
        for (std::size_t k = 0; k < 4; ++k)
            v[(largest + k) % 4] = rounded<std::int16_t>(parts[k] * 32767);
        std::memcpy(bytes, v, sizeof v);
    }
}

constexpr Filter kFilters[] = {
    {"NONE", true, true, true, nullptr},
    {"OCTAHEDRAL", false, true, true, decodeOctahedralFilter},
    {"QUATERNION", false, false, true, decodeQuaternionFilter},
    {"EXPONENTIAL", true, true, true, meshopt_decodeFilterExp},
    {"COLOR", false, true, true, decodeColorFilter},
};

template <typename Row, std::size_t n>
const Row& rowOf(const Row (&rows)[n], const std::string& name, const char* kind) {
    for (const Row& row : rows)
        if (name == row.name) return row;
    failMeshopt("the meshopt " + std::string(kind) + " \"" + name.substr(0, 40) + "\" is not known",
                "decompress the file, e.g. with: gltf-transform copy in.glb out.glb");
}

void checkHeader(const Mode& mode, std::uint8_t first) {
    if ((first & 0xF0) != mode.header)
        failMeshopt("the data is not a meshopt stream of mode " + std::string(mode.name));
    if (const int version = first & 0x0F; version > mode.version)
        failMeshopt("the data has version " + std::to_string(version) +
                        " of the codec, but the installed libmeshoptimizer " +
                        std::to_string(MESHOPTIMIZER_VERSION / 1000) + "." +
                        std::to_string(MESHOPTIMIZER_VERSION / 10 % 100) + " decodes up to " +
                        std::to_string(mode.version),
                    "compress the file with EXT_meshopt_compression, which is version 0");
}

}  // namespace

void checkMeshoptStream(const MeshoptStream& stream) {
    const Mode& mode = rowOf(kModes, stream.mode, "mode");
    const Filter& filter = rowOf(kFilters, stream.filter, "filter");
    const std::uint64_t stride = stream.stride;
    const bool attributes = mode.header == 0xA0;
    const auto refuse = [&](const char* rule) {
        failMeshopt("the stride of " + std::to_string(stride) + " bytes is invalid for mode " +
                    stream.mode + " with filter " + stream.filter + ": " + rule);
    };
    if (attributes && (stride % 4 != 0 || stride == 0 || stride > 256))
        refuse("it must be a multiple of 4 up to 256");
    if (!attributes && stride != 2 && stride != 4) refuse("it must be 2 or 4");
    if (!attributes && filter.decode)
        failMeshopt("filter " + stream.filter + " cannot be used with mode " + stream.mode);
    if (!filter.any_stride && !(filter.four && stride == 4) && !(filter.eight && stride == 8))
        refuse(filter.four ? "it must be 4 or 8" : "it must be 8");
    if (mode.header == 0xE0 && stream.count % 3 != 0)
        failMeshopt("the count of " + std::to_string(stream.count) +
                    " indices is not a multiple of 3");
    if (stream.bytes.empty()) failMeshopt("the compressed data is empty");
    checkHeader(mode, stream.bytes[0]);
    const std::uint64_t least = mode.least_bytes(stream.count, stride);
    if (stream.bytes.size() < least)
        failMeshopt(std::to_string(stream.count) + " elements of " + std::to_string(stride) +
                    " bytes need at least " + std::to_string(least) +
                    " compressed bytes, but only " + std::to_string(stream.bytes.size()) +
                    " are there");
}

void decodeMeshoptStream(const MeshoptStream& stream, std::span<std::uint8_t> out) {
    const Mode& mode = rowOf(kModes, stream.mode, "mode");
    const Filter& filter = rowOf(kFilters, stream.filter, "filter");
    const int result = mode.decode(out.data(), stream.count, stream.stride, stream.bytes.data(),
                                   stream.bytes.size());
    if (result != 0)
        failMeshopt("the meshopt data is damaged (the decoder says " + std::to_string(result) +
                    ")");
    if (filter.decode) filter.decode(out.data(), stream.count, stream.stride);
}

}  // namespace peeler
