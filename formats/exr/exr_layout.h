// SPDX-License-Identifier: Apache-2.0
// The tables of layouts (how the layers of a picture are spread over channels, parts and files) and
// of the lossless ways to compress OpenEXR files that peeler writes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// A layout. The composite, where there is one, comes first and has plain channel names.
struct ExrLayout {
    std::string_view name;     ///< OutputOptions::layout and `peeler:layout`
    std::string_view summary;  ///< one line
    bool one_part = false;     ///< all layers and the composite in one part
    bool prefixed = false;     ///< a layer's channels are layer_000.R, …
    bool one_file_a_layer = false;
    std::string_view composite_part = "composite";  ///< the name of its part
};

inline constexpr int kExrRowsPerChunk = 16;  ///< of ZIP compression

inline constexpr std::string_view kPerFileLayout = "per-file";

inline constexpr int kMostLayers = 1 << 16;  ///< of a picture that is read

/// Every layout; the first is the default.
std::span<const ExrLayout> exrLayouts();

/// The layout with this name, "" being the default. Throws Error (kUsage) that lists the choices.
const ExrLayout& findExrLayout(std::string_view name);

/// "layer_000", "layer_001", …: at least three digits.
std::string layerName(std::size_t layer);

/// The number in "layer_012" or before the first dot of "layer_012.R"; −1 if the name is another.
int layerNumber(std::string_view name);

struct ExrCompression {
    std::string_view name;  ///< OutputOptions::compression, ExrInputPart::compression
    std::string_view summary;
    bool deep = true;  ///< deep images may have it
    int value = 0;     ///< Imf::Compression
};

/// The most bytes that zlib can make of one are 1032; this is that with some room.
inline constexpr std::uint64_t kMostZlibRatio = 1100;

/// All of them; the first is the default of layered files, the second that of deep ones.
std::span<const ExrCompression> exrCompressions();

/// The compression with this name; "" is the default of flat or deep images. Throws Error (kUsage)
/// that lists the choices if there is none for such images.
const ExrCompression& findExrCompression(std::string_view name, bool deep);

}  // namespace peeler
