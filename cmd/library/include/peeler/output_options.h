// SPDX-License-Identifier: Apache-2.0
// The options of writing a file: kind, layout, compression, display, provenance.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include <peeler/deep_merge.h>
#include <peeler/sink.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Exposure and alpha of a picture for display, as they were written; complete after finish().
struct DisplayOutcome {
    float exposure = 0;               ///< stops
    std::uint64_t raised_pixels = 0;  ///< whose alpha was raised to hold their colour
};

/// Lists of fragments as planes: plane k has the k-th fragment of every pixel.
struct DenseSettings {
    std::uint32_t layers = 0;  ///< planes, from the front; 0 = as many as the picture has layers
    PixelType type = PixelType::kFloat;  ///< of numbers that are no integers; or kHalf
    /// What these are where a pixel has no such fragment.
    double fill = std::numeric_limits<double>::quiet_NaN();
    bool repeat_last = false;  ///< there they are those of its last fragment; NaN if it has none
};

/// Fields that a format has no use for are ignored.
struct OutputOptions {
    std::string as{};                ///< kind; "" = the extension's first row in the table
    bool no_composite = false;       ///< ldi: leave the part `composite` out
    bool cryptomatte = false;        ///< ldi, composite: in the composite; needs id.*
    bool composited = false;         ///< composite: bands are a composite, as it is stored
    std::string layout{};            ///< ldi: a name in exrLayouts(), "" = plain
    DeepMergeSettings deep_merge{};  ///< deep
    std::string compression{};       ///< ldi, deep: one of exrCompressions(), "" = default
    /// Premultiplied linear RGBA, of a composite or a page; in PNG, JPEG and TIFF display values,
    /// which exposure and tone map leave as they are.
    std::array<float, 4> background{};
    float exposure = 0;                       ///< stops; PNG, JPEG, TIFF, page
    bool automatic_exposure = false;          ///< in place of `exposure`: ExposureMeter's
    std::string tone_map = "none";            ///< PNG, JPEG, TIFF, page
    DenseSettings dense{};                    ///< dense
    std::uint64_t max_fragments = 4'000'000;  ///< page: more than these it does not hold
    Provenance provenance{};
    std::shared_ptr<DisplayOutcome> outcome{};  ///< PNG, JPEG, TIFF, page: filled in, unless null
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
