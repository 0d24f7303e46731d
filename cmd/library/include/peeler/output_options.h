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

/// The exposure applied to a display picture, and the number of pixels with changed alpha. The
/// values are valid after finish().
struct DisplayOutcome {
    float exposure = 0;  ///< stops
    /// Number of pixels with alpha raised above the pixel's coverage.
    std::uint64_t raised_pixels = 0;
};

/// Options for dense planes: plane k holds the k-th fragment of every pixel.
struct DenseSettings {
    /// Number of planes, from the front; 0 = one per layer of the picture.
    std::uint32_t layers = 0;
    /// Type of quantities that are not integers: kFloat or kHalf.
    PixelType type = PixelType::kFloat;
    /// The value of non-integer quantities where a pixel has no k-th fragment.
    double fill = std::numeric_limits<double>::quiet_NaN();
    /// Whether to fill with the pixel's last fragment instead; NaN if the pixel has no fragments.
    bool repeat_last = false;
};

/// Options for openFile(). The comments name the kinds of output that use a field; other kinds
/// ignore it.
struct OutputOptions {
    std::string as{};                ///< kind; "" = the first in the format table for the extension
    bool no_composite = false;       ///< ldi: omit the part `composite`
    bool cryptomatte = false;        ///< ldi, composite: add Cryptomatte; needs the channels id.*
    bool composited = false;         ///< composite: whether the bands are already composited
    std::string layout{};            ///< ldi: a name from exrLayouts(), "" = plain
    DeepMergeSettings deep_merge{};  ///< deep: how to merge samples
    std::string compression{};       ///< ldi, deep: a name from exrCompressions(), "" = default
    /// Premultiplied linear RGBA for a composite or a page. For PNG, JPEG and TIFF, a display
    /// colour that exposure and tone map do not change.
    std::array<float, 4> background{};
    /// PNG, JPEG, TIFF: blend the background in sRGB-encoded values (SplatBlending::kDisplay).
    bool blends_encoded = false;
    float exposure = 0;               ///< PNG, JPEG, TIFF, page: exposure in stops
    bool automatic_exposure = false;  ///< use the ExposureMeter's value in place of `exposure`
    std::string tone_map = "none";    ///< PNG, JPEG, TIFF, page: name of the tone map
    DenseSettings dense{};            ///< dense: how to write the planes
    bool compress = false;            ///< .npz: DEFLATE; keeps the arrays in memory until finish()
    std::uint64_t max_fragments = 4'000'000;  ///< page: maximum number of fragments
    Provenance provenance{};
    /// PNG, JPEG, TIFF, page: filled by the sink unless null.
    std::shared_ptr<DisplayOutcome> outcome{};
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
