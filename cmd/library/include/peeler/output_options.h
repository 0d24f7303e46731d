// SPDX-License-Identifier: Apache-2.0
// Output options: kind, layout, compression, display, provenance.
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

/// The exposure and alpha actually written to a display picture. Valid after finish().
struct DisplayOutcome {
    float exposure = 0;               ///< stops
    std::uint64_t raised_pixels = 0;  ///< pixels whose alpha was raised to hold their colour
};

/// Fragment lists as dense planes: plane k holds the k-th fragment of every pixel.
struct DenseSettings {
    std::uint32_t layers = 0;  ///< planes, from the front; 0 = as many as the picture has layers
    PixelType type = PixelType::kFloat;  ///< kFloat or kHalf, for non-integers
    /// The value of non-integers where a pixel has no such fragment.
    double fill = std::numeric_limits<double>::quiet_NaN();
    bool repeat_last = false;  ///< fill with the pixel's last fragment instead; NaN if it has none
};

/// Options for openFile(). A format ignores fields it does not use.
struct OutputOptions {
    std::string as{};           ///< kind; "" = the extension's first row in the table
    bool no_composite = false;  ///< ldi: omit the part `composite`
    bool cryptomatte = false;   ///< ldi, composite: add Cryptomatte to the composite; needs id.*
    bool composited = false;    ///< composite: the bands are already composited
    std::string layout{};       ///< ldi: a name in exrLayouts(), "" = plain
    DeepMergeSettings deep_merge{};  ///< deep
    std::string compression{};       ///< ldi, deep: one of exrCompressions(), "" = default
    /// Premultiplied linear RGBA for a composite or a page. PNG, JPEG and TIFF: display values, not
    /// affected by exposure and tone map.
    std::array<float, 4> background{};
    float exposure = 0;                       ///< stops; PNG, JPEG, TIFF, page
    bool automatic_exposure = false;          ///< use ExposureMeter in place of `exposure`
    std::string tone_map = "none";            ///< PNG, JPEG, TIFF, page
    DenseSettings dense{};                    ///< dense
    std::uint64_t max_fragments = 4'000'000;  ///< page: upper limit
    Provenance provenance{};
    std::shared_ptr<DisplayOutcome> outcome{};  ///< PNG, JPEG, TIFF, page: filled in unless null
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
