// SPDX-License-Identifier: Apache-2.0
// The tables of layouts and compressions, and names of layers.
#include "formats/exr/exr_layout.h"

#include <OpenEXR/ImfCompression.h>

#include <algorithm>
#include <charconv>
#include <string>
#include <system_error>

#include <peeler/error.h>

namespace peeler {
namespace {

constexpr std::string_view kLayerPrefix = "layer_";

// Nuke derives the names of layers from channel names, and displays the layer "rgba". The layout
// "nuke" also follows OpenEXR's rule for channel names in multi-part files
// (openexr.com/en/latest/MultiViewOpenEXR.html).
constexpr ExrLayout kLayouts[] = {
    {"plain", "one part per layer, R,G,B,A,Z in each"},
    {.name = "nuke",
     .summary = "one part per layer, channels layer_000.R, …; the composite is rgba",
     .prefixed = true,
     .composite_part = "rgba"},
    {.name = "single-part",
     .summary = "one part: the composite as R,G,B,A,Z, the layers as layer_000.R, …",
     .one_part = true,
     .prefixed = true},
    {.name = kPerFileLayout,
     .summary = "OUT.exr holds the composite, OUT.layer_000.exr, … one layer each",
     .one_file_a_layer = true},
};

constexpr ExrCompression kCompressions[] = {
    {"zip", "16 rows at once; default for layered files", false, Imf::ZIP_COMPRESSION},
    {"zips", "row by row; default for deep images", true, Imf::ZIPS_COMPRESSION},
    {"rle", "run lengths: quicker and larger", true, Imf::RLE_COMPRESSION},
    {"none", "uncompressed", true, Imf::NO_COMPRESSION},
};

}  // namespace

std::span<const ExrLayout> exrLayouts() {
    return kLayouts;
}

const ExrLayout& findExrLayout(std::string_view name) {
    if (name.empty()) return kLayouts[0];
    std::string names;
    for (const ExrLayout& layout : kLayouts) {
        if (layout.name == name) return layout;
        names += (names.empty() ? "" : ", ") + std::string(layout.name);
    }
    throw Error(ErrorKind::kUsage, "unknown layout \"" + std::string(name) + "\"",
                Parameter::kLayout, "choose one of: " + names);
}

std::string layerName(std::size_t layer) {
    constexpr std::size_t kDigits = 3;
    const std::string number = std::to_string(layer);
    return std::string(kLayerPrefix) +
           std::string(kDigits - std::min(kDigits, number.size()), '0') + number;
}

int layerNumber(std::string_view name) {
    name = name.substr(0, name.find('.'));
    if (!name.starts_with(kLayerPrefix)) return -1;
    int number = -1;
    const char* end = name.data() + name.size();
    const auto [stop, failure] = std::from_chars(name.data() + kLayerPrefix.size(), end, number);
    return failure == std::errc() && stop == end ? number : -1;
}

std::span<const ExrCompression> exrCompressions() {
    return kCompressions;
}

const ExrCompression& findExrCompression(std::string_view name, bool deep) {
    std::string names;
    for (const ExrCompression& row : kCompressions) {
        if (deep && !row.deep) continue;
        if (name.empty() || row.name == name) return row;
        names += (names.empty() ? "" : ", ") + std::string(row.name);
    }
    throw Error(ErrorKind::kUsage,
                (deep ? "deep images cannot be compressed as \"" : "unknown compression \"") +
                    std::string(name) + "\"",
                Parameter::kCompression, "choose one of: " + names);
}

}  // namespace peeler
