// SPDX-License-Identifier: Apache-2.0
// The tables of layouts (the distribution of a picture's layers over channels, parts and files) and
// of the lossless OpenEXR compressions that peeler writes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// A layout. The composite, if any, is the first part and has plain channel names.
struct ExrLayout {
    std::string_view name;     ///< name in OutputOptions::layout and in `peeler:layout`
    std::string_view summary;  ///< description, one line
    bool one_part = false;     ///< whether all layers and the composite are in one part
    bool prefixed = false;     ///< whether channels of layers have names like layer_000.R
    bool one_file_a_layer = false;
    std::string_view composite_part = "composite";  ///< name of the composite's part
};

inline constexpr int kExrRowsPerChunk = 16;  ///< rows per chunk of ZIP compression

inline constexpr std::string_view kPerFileLayout = "per-file";

inline constexpr int kMostLayers = 1 << 16;  ///< maximum number of layers of an input picture

/// Returns every layout; the first is the default.
std::span<const ExrLayout> exrLayouts();

/// Returns the layout with this name; "" means the default. Throws Error (kUsage), with a list of
/// the names, if the name is unknown.
const ExrLayout& findExrLayout(std::string_view name);

/// Returns "layer_000", "layer_001", …, with at least three digits.
std::string layerName(std::size_t layer);

/// Returns 12 for "layer_012" and for "layer_012.R"; −1 for any other name.
int layerNumber(std::string_view name);

struct ExrCompression {
    /// Name in OutputOptions::compression and ExrInputPart::compression.
    std::string_view name;
    std::string_view summary;
    bool deep = true;  ///< whether deep images may have this compression
    int value = 0;     ///< value of Imf::Compression
};

/// The maximum number of bytes unpacked from one byte of zlib data: 1032, plus a margin.
inline constexpr std::uint64_t kMostZlibRatio = 1100;

/// Returns all compressions. The first is the default of layered files, the second that of deep
/// files.
std::span<const ExrCompression> exrCompressions();

/// Returns the compression with this name. "" means the default of deep images if `deep` is true,
/// else the default of flat images. Throws Error (kUsage), with a list of the choices, if such
/// images cannot have the compression.
const ExrCompression& findExrCompression(std::string_view name, bool deep);

}  // namespace peeler
