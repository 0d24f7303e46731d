// SPDX-License-Identifier: Apache-2.0
// The table of output formats.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/merge.h"
#include "core/image/sink.h"

namespace peeler {

/// What the command line says about an output file. Fields that a format has no use for are
/// ignored.
struct OutputOptions {
    std::string as;                           ///< kind; "" = the extension's first row in the table
    bool composite_part = true;               ///< ldi: begin with a part `composite`
    bool cryptomatte = false;                 ///< ldi, composite: in the composite part
    bool composited = false;                  ///< composite: bands are one already, as it is stored
    std::string layout;                       ///< ldi: a name in exrLayouts(), "" = plain
    DeepMergeSettings deep_merge;             ///< deep
    std::string compression;                  ///< ldi, deep: one of exrCompressions(), "" = default
    std::array<float, 4> background{};        ///< premultiplied linear RGBA; composite, page
    float exposure = 0;                       ///< stops; PNG, JPEG, TIFF, page
    std::string tone_map = "none";            ///< PNG, JPEG, TIFF, page
    std::uint64_t max_fragments = 4'000'000;  ///< page: more than these it does not hold
    Provenance provenance;
};

/// One way to write a picture.
struct OutputFormat {
    std::vector<std::string_view> extensions{};  ///< lower case, with the dot
    std::string_view kind;                       ///< for --as
    std::string_view summary;
    std::unique_ptr<Sink> (*make)(const std::string& path, const OutputOptions& options);
    /// It shows what casts shadows: both faces of OPAQUE and MASK surfaces, every layer of them.
    bool casters = false;
    bool channels = false;  ///< it holds what fragments have besides colour and Z
    bool composite = true;  ///< a composite is in it
    /// It is for eyes and not for further work: encoded for a display, with exposure and tone map.
    bool encoded = false;
};

/// Every format; of two rows with the same extension the first is the default.
std::span<const OutputFormat> outputFormats();

/// The row for a path (its extension, upper or lower case) and `--as`. Throws Error (kUsage) that
/// lists the choices.
const OutputFormat& findOutputFormat(std::string_view path, std::string_view as);

/// A Sink for the path. Nothing is created on disk before its begin(). Throws like
/// findOutputFormat, and Error (kUsage) if an option has a value that the format does not know.
std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options);

}  // namespace peeler
