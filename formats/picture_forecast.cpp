// SPDX-License-Identifier: Apache-2.0
// Size forecasts of picture files from the count pass: exact sizes or upper bounds.
#include <algorithm>
#include <iterator>

#include "formats/image/image_writer.h"
#include "formats/writers.h"

namespace peeler {
namespace {

using Bytes = std::uint64_t;

/// Sizes that the forecasts of all kinds of files share.
struct PlannedBytes {
    PlannedBytes(const Plan& of, const OutputOptions& options)
        : plan(of),
          pixels(of.view.crop.pixels()),
          rows(static_cast<Bytes>(of.view.crop.height())),
          fragment(colorNames(of.tinted).size() * pixelTypeSize(of.color_type) + sizeof(float) +
                   of.channel_bytes),
          header(exrHeaderBytes(options.provenance.ids)) {}

    /// Returns the bytes of a flat part with `pixel` bytes per pixel.
    Bytes part(const Window& window, Bytes pixel) const {
        return header + pixel * window.pixels() +
               kExrChunkBytes * static_cast<Bytes>(window.height());
    }

    const Plan& plan;
    Bytes pixels, rows;
    Bytes fragment;  ///< in bytes: colour, Z and channels
    Bytes header;
};

Bytes compositeBytes(const PlannedBytes& planned, const OutputOptions& options) {
    // Two Cryptomatte layers, each with six pairs of 32-bit floats.
    constexpr Bytes kCryptomatteBytes = sizeof(float) * 2 * 6 * 2;
    return planned.part(planned.plan.view.crop,
                        planned.fragment + (options.cryptomatte ? kCryptomatteBytes : 0));
}

/// Returns the bytes of layered files. In a single part, the data window of all layers is at most
/// the crop.
Bytes layersBytes(const PlannedBytes& planned, const OutputOptions& options) {
    const Plan& plan = planned.plan;
    const bool one_part = options.layout == "single-part";
    Bytes bytes = options.no_composite ? planned.header : compositeBytes(planned, options);
    for (const LayerPlan& layer : plan.layers)
        bytes += planned.part(one_part ? plan.view.crop : layer.data_window, planned.fragment);
    return bytes;
}

/// Returns the bytes of deep files. Ids are in their own part, with their own Z and sample counts.
Bytes samplesBytes(const PlannedBytes& planned, const OutputOptions&) {
    constexpr Bytes kParts = 2;
    return kParts * (planned.header + kExrChunkBytes * planned.rows +
                     sizeof(std::uint32_t) * planned.pixels) +
           planned.plan.fragments_stored * (planned.fragment + sizeof(float));
}

/// Returns the bytes of a page. Before DEFLATE, a fragment takes 18 bytes, 3 more with coloured
/// opacity and 8 more with ids. Base 64 then turns every 3 bytes into 4. Names take hardly more
/// bytes than in an EXR header.
Bytes pageBytes(const PlannedBytes& planned, const OutputOptions& options) {
    constexpr Bytes kViewer = std::uint64_t{256} << 10;
    const bool ids = !options.provenance.ids.empty();
    const Bytes packed = 18 + (planned.plan.tinted ? 3 : 0) + (ids ? 8 : 0);
    return kViewer + 2 * planned.header + planned.plan.fragments_stored * packed * 4 / 3;
}

Bytes shadowMapBytes(const PlannedBytes& planned, const OutputOptions&) {
    return planned.part(planned.plan.view.crop, sizeof(float));
}

struct ContentBytes {
    OutputContent content;
    Bytes (*bytes)(const PlannedBytes& planned, const OutputOptions& options);
};

constexpr ContentBytes kContents[] = {
    {OutputContent::kLayers, layersBytes},       {OutputContent::kSamples, samplesBytes},
    {OutputContent::kComposite, compositeBytes}, {OutputContent::kShadowMap, shadowMapBytes},
    {OutputContent::kPage, pageBytes},
};

}  // namespace

SizeForecast forecastPicture(const std::string& path, const Plan& plan,
                             const OutputOptions& options) {
    const OutputFormat& format = findOutputFormat(path, options.as);
    if (format.forecast) return format.forecast(path, plan, options);
    if (findImageFormat(path)) return imageForecast(path, plan.view.crop.pixels());
    const auto* const row = std::ranges::find(kContents, format.content, &ContentBytes::content);
    return {row->bytes(PlannedBytes(plan, options), options), Certainty::kAtMost};
}

}  // namespace peeler
