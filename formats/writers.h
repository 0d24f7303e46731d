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

/// The content of a file, which decides its options.
enum class OutputContent : std::uint8_t {
    kLayers,     ///< the layers of every pixel, in a layout, with their composite unless left out
    kSamples,    ///< the same fragments as deep samples, which may be merged
    kLists,      ///< the same fragments as lists, as in memory
    kComposite,  ///< the layers composited, over a background
    /// A midpoint shadow map; needs every layer of OPAQUE and MASK surfaces, both faces of each.
    kShadowMap,
    kPage,    ///< a viewer of the layers, with a background
    kArrays,  ///< the values of every fragment, as lists
    kPlanes,  ///< the same as planes: the nearest fragments per pixel
    /// For third-party loaders, one ray per pixel: a picture over black with the depths of its
    /// layers beside it (LaRI), and layers as a sparse matrix (X-Ray).
    kLari,
    kXray,
};

/// An output format.
struct OutputFormat {
    std::vector<std::string_view> extensions{};  ///< lower case, with the dot
    std::string_view kind;                       ///< OutputOptions::as
    std::string_view summary;
    std::unique_ptr<Sink> (*make)(const std::string& path, const OutputOptions& options);
    OutputContent content = OutputContent::kComposite;
    bool channels = false;  ///< holds channels besides colour and Z
    /// For viewing, not for further work: display-encoded, with exposure and tone map.
    bool for_display = false;
    /// The channels it always needs, in addition to any requested ones.
    std::span<const Channel> (*needs)() = nullptr;
    /// Forecasts the size of its files where the writer knows it better than forecastPicture().
    SizeForecast (*forecast)(const std::string& path, const Plan& plan,
                             const OutputOptions& options) = nullptr;
    /// The files published together with the one at `path`, which is published last.
    std::vector<std::string> (*beside)(const std::string& path) = nullptr;

    bool holds(OutputContent what) const { return content == what; }
    /// Whether every fragment can be read back.
    bool holdsFragments() const { return isCompressed() || holds(OutputContent::kLists); }
    bool isCompressed() const {
        return holds(OutputContent::kLayers) || holds(OutputContent::kSamples);
    }
    bool hasComposite() const {
        return holds(OutputContent::kLayers) || holds(OutputContent::kComposite);
    }
    bool takesOneSample() const {
        return holds(OutputContent::kLari) || holds(OutputContent::kXray);
    }
    bool takesBackground() const {
        return holds(OutputContent::kComposite) || holds(OutputContent::kPage);
    }
};

/// Returns every format; of two rows with the same extension, the first is the default.
std::span<const OutputFormat> outputFormats();

/// Returns the row for a path's extension (upper or lower case) and a kind. Throws Error (kUsage)
/// listing the choices for an unknown one.
const OutputFormat& findOutputFormat(std::string_view path, std::string_view as);

/// Returns the files published beside the one at `path` (OutputFormat::beside); empty if there is
/// no such format.
std::vector<std::string> filesBeside(const std::string& path, const OutputOptions& options);

/// Forecasts the size of a planned picture's file, or of all its files together. Exact for arrays;
/// an upper bound for compressed files, and for samples that will be merged. Throws like
/// findOutputFormat().
SizeForecast forecastPicture(const std::string& path, const Plan& plan,
                             const OutputOptions& options);

/// Returns a Sink for the path. Creates nothing on disk before begin(). Throws like
/// findOutputFormat(), and Error (kUsage) if an option has a value the format does not know.
std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options);

/// Writes a finished picture to `path`, whole or not at all, in the flat format of its extension.
/// The window of `picture` becomes the whole picture, with its upper left corner at (0, 0). Throws
/// like makeSink() and the sink.
void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options);

}  // namespace peeler
