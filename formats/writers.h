// SPDX-License-Identifier: Apache-2.0
// The table of output formats: extension, kind, content, and the Sink that writes each.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/channels.h>
#include <peeler/composite.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/file/size_forecast.h"

namespace peeler {

/// The content of an output file, which decides the options that apply to it.
enum class OutputContent : std::uint8_t {
    /// The layers of every pixel, in a layout, with their composite unless the options leave it
    /// out.
    kLayers,
    kSamples,    ///< the fragments as deep samples, which may be merged
    kLists,      ///< the fragments as per-pixel lists, as in memory
    kComposite,  ///< the layers composited over a background
    /// A midpoint shadow map, made from all OPAQUE and MASK surfaces with both faces.
    kShadowMap,
    kPage,    ///< a web page that shows the layers over a background
    kArrays,  ///< arrays of fragment values, as per-pixel lists
    kPlanes,  ///< arrays of planes: plane k holds each pixel's k-th nearest fragment
    /// Files for third-party loaders, with one ray per pixel. kLari, kWorldTracing: a picture over
    /// black, and arrays of its layers' depths or points. kXray: the layers as a sparse matrix.
    kLari,
    kWorldTracing,
    kXray,
};

struct OutputFormat {
    std::vector<std::string_view> extensions{};  ///< extensions in lower case, with the dot
    std::string_view kind;                       ///< kind in OutputOptions::as
    std::string_view summary;
    std::unique_ptr<Sink> (*make)(const std::string& path, const OutputOptions& options);
    OutputContent content = OutputContent::kComposite;
    bool channels = false;  ///< whether the file may hold channels besides colour and Z
    /// Whether the files are for viewing rather than further processing: display-encoded, with
    /// exposure and tone map.
    bool for_display = false;
    /// Returns the channels that the format always needs.
    std::span<const Channel> (*needs)() = nullptr;
    /// Forecasts the size of the format's files. If null, forecastPicture() calculates the size.
    SizeForecast (*forecast)(const std::string& path, const Plan& plan,
                             const OutputOptions& options) = nullptr;
    /// Returns the files that are published together with the file at `path`, but before it.
    std::vector<std::string> (*beside)(const std::string& path,
                                       const OutputOptions& options) = nullptr;

    bool holds(OutputContent what) const { return content == what; }
    /// Whether every fragment can be read back from the file.
    bool holdsFragments() const { return isCompressed() || holds(OutputContent::kLists); }
    bool isCompressed() const {
        return holds(OutputContent::kLayers) || holds(OutputContent::kSamples);
    }
    /// Whether Cryptomatte can be stored: in the composite, or in the file beside a deep image.
    bool takesCryptomatte() const {
        return channels && (hasComposite() || holds(OutputContent::kSamples));
    }
    bool hasComposite() const {
        return holds(OutputContent::kLayers) || holds(OutputContent::kComposite);
    }
    /// Whether the files are for loaders of data sets.
    bool isSample() const { return takesOneSample() || holds(OutputContent::kPlanes); }
    bool takesOneSample() const { return isOverBlack() || holds(OutputContent::kXray); }
    /// Whether the files are a picture over black, with arrays beside it.
    bool isOverBlack() const {
        return holds(OutputContent::kLari) || holds(OutputContent::kWorldTracing);
    }
    bool takesBackground() const {
        return holds(OutputContent::kComposite) || holds(OutputContent::kPage);
    }
};

/// Returns every format. If rows share an extension, the first of them is the default.
std::span<const OutputFormat> outputFormats();

/// Returns the row for a path's extension (upper or lower case) and a kind. Throws Error (kUsage),
/// with a list of the choices, if there is no such row.
const OutputFormat& findOutputFormat(std::string_view path, std::string_view as);

/// Returns the files published beside the file at `path` (OutputFormat::beside); empty if the
/// format has none.
std::vector<std::string> filesBeside(const std::string& path, const OutputOptions& options);

/// Forecasts the total size of a planned picture's files. The forecast is exact for arrays, and an
/// upper bound for compressed files and for samples that will be merged. Throws like
/// findOutputFormat().
SizeForecast forecastPicture(const std::string& path, const Plan& plan,
                             const OutputOptions& options);

/// Returns a Sink for the path; the Sink creates nothing on disk before begin(). Throws like
/// findOutputFormat(), and Error (kUsage) if an option has a value that the format does not know.
std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options);

/// Writes a finished picture to `path`, atomically, in the flat format of its extension. The window
/// of `picture` becomes the whole picture, with its upper left corner at (0, 0). Throws like
/// makeSink() and the Sink's members.
void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options);

}  // namespace peeler
