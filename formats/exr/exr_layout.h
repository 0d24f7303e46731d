// SPDX-License-Identifier: Apache-2.0
// The tables of layouts (how a picture's layers are spread over channels, parts and files) and of
// lossless OpenEXR compressions that peeler writes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// A layout. The composite, if any, comes first and has plain channel names.
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

inline constexpr int kMostLayers = 1 << 16;  ///< of a picture being read

/// Returns every layout; the first is the default.
std::span<const ExrLayout> exrLayouts();

/// Returns the layout with this name; "" is the default. Throws Error (kUsage) listing the choices
/// for an unknown name.
const ExrLayout& findExrLayout(std::string_view name);

/// Returns "layer_000", "layer_001", …, with at least three digits.
std::string layerName(std::size_t layer);

/// Returns the number in "layer_012" or before the first dot of "layer_012.R"; −1 for any other
/// name.
int layerNumber(std::string_view name);

struct ExrCompression {
    std::string_view name;  ///< OutputOptions::compression, ExrInputPart::compression
    std::string_view summary;
    bool deep = true;  ///< valid for deep images
    int value = 0;     ///< Imf::Compression
};

/// The maximum expansion of zlib is 1032 bytes per byte; this adds a margin.
inline constexpr std::uint64_t kMostZlibRatio = 1100;

/// Returns all compressions; the first is the default of layered files, the second that of deep
/// ones.
std::span<const ExrCompression> exrCompressions();

/// Returns the compression with this name; "" is the default of flat or deep images. Throws Error
/// (kUsage) listing the choices if such images cannot have it.
const ExrCompression& findExrCompression(std::string_view name, bool deep);

}  // namespace peeler
