// SPDX-License-Identifier: Apache-2.0
// The table of output formats: by which extension and kind one is chosen, what its files hold, and
// who writes them.
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

/// What is in a file, which decides the options that it takes.
enum class OutputContent : std::uint8_t {
    kLayers,     ///< the layers of every pixel, in a layout, with their composite unless left out
    kSamples,    ///< the same fragments as deep samples, which may be merged
    kLists,      ///< the same fragments in lists, as they are in memory
    kComposite,  ///< the layers composited, over a background
    /// A midpoint shadow map, which needs every layer of OPAQUE and MASK surfaces, both faces of
    /// each.
    kShadowMap,
    kPage,    ///< a viewer of the layers, with a background
    kArrays,  ///< the numbers of every fragment, in lists
    kPlanes,  ///< the same in planes, the nearest of every pixel
    /// For the loaders of others, of which each pixel is one ray: a picture over black with depths
    /// of its layers beside it, and layers as a sparse matrix.
    kLari,
    kXray,
};

/// One way to write a picture.
struct OutputFormat {
    std::vector<std::string_view> extensions{};  ///< lower case, with the dot
    std::string_view kind;                       ///< OutputOptions::as
    std::string_view summary;
    std::unique_ptr<Sink> (*make)(const std::string& path, const OutputOptions& options);
    OutputContent content = OutputContent::kComposite;
    bool channels = false;  ///< it holds what fragments have besides colour and Z
    /// It is for eyes and not for further work: encoded for a display, with exposure and tone map.
    bool for_display = false;
    /// The channels that it is made of, whatever else is asked for.
    std::span<const Channel> (*needs)() = nullptr;
    /// The size of its files, where the writer knows it better than forecastPicture().
    SizeForecast (*forecast)(const std::string& path, const Plan& plan,
                             const OutputOptions& options) = nullptr;
    /// The files that appear together with the one at `path`, which appears last.
    std::vector<std::string> (*beside)(const std::string& path) = nullptr;

    bool holds(OutputContent what) const { return content == what; }
    /// Every fragment can be read from it again.
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

/// Every format; of two rows with the same extension the first is the default.
std::span<const OutputFormat> outputFormats();

/// The row for a path (its extension, upper or lower case) and a kind. Throws Error (kUsage) that
/// lists the choices.
const OutputFormat& findOutputFormat(std::string_view path, std::string_view as);

/// The files that appear beside the one at `path`: OutputFormat::beside. None where there is no
/// such format.
std::vector<std::string> filesBeside(const std::string& path, const OutputOptions& options);

/// How large the file of a planned picture will be, or all of its files together. Arrays take so
/// much to the byte; what is compressed takes it at most, and what is merged into fewer samples
/// takes less. Throws like findOutputFormat().
SizeForecast forecastPicture(const std::string& path, const Plan& plan,
                             const OutputOptions& options);

/// A Sink for the path. Nothing is created on disk before its begin(). Throws like
/// findOutputFormat, and Error (kUsage) if an option has a value that the format does not know.
std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options);

/// Writes a finished picture to `path`, whole or not at all, in the flat format of its extension.
/// The window of `picture` becomes the whole picture, with its upper left corner at (0, 0). Throws
/// like makeSink() and the sink.
void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options);

}  // namespace peeler
