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

/// The exposure applied to a display picture, and the number of pixels whose alpha was changed. The
/// values are valid after finish().
struct DisplayOutcome {
    float exposure = 0;  ///< stops
    /// Number of pixels whose alpha was raised above their coverage.
    std::uint64_t raised_pixels = 0;
};

/// Options for fragment lists as dense planes: plane k holds the k-th fragment of every pixel.
struct DenseSettings {
    /// Number of planes, from the front; 0 = one per layer of the picture
    std::uint32_t layers = 0;
    /// Type of quantities that are not integers: kFloat or kHalf.
    PixelType type = PixelType::kFloat;
    /// The value of non-integer quantities where a pixel has no k-th fragment.
    double fill = std::numeric_limits<double>::quiet_NaN();
    bool repeat_last = false;  ///< fill with the pixel's last fragment instead; NaN if it has none
};

/// Options for openFile(). Each format ignores the fields it does not use; the comments name the
/// kinds that use a field.
struct OutputOptions {
    std::string as{};                ///< kind; "" = the first in the format table for the extension
    bool no_composite = false;       ///< ldi: omit the part `composite`
    bool cryptomatte = false;        ///< ldi, composite: add Cryptomatte; needs the channels id.*
    bool composited = false;         ///< composite: whether the bands arrive already composited
    std::string layout{};            ///< ldi: a name from exrLayouts(), "" = plain
    DeepMergeSettings deep_merge{};  ///< deep: how to merge samples
    std::string compression{};       ///< ldi, deep: a name from exrCompressions(), "" = default
    /// Premultiplied linear RGBA for a composite or a page. For PNG, JPEG and TIFF it is a display
    /// colour, which exposure and tone map do not change.
    std::array<float, 4> background{};
    float exposure = 0;               ///< PNG, JPEG, TIFF, page: exposure in stops
    bool automatic_exposure = false;  ///< use the ExposureMeter's value in place of `exposure`
    std::string tone_map = "none";    ///< PNG, JPEG, TIFF, page: name of the tone map
    DenseSettings dense{};            ///< dense: how to write the planes
    bool compress = false;            ///< .npz: DEFLATE arrays, which are kept in memory until then
    std::uint64_t max_fragments = 4'000'000;  ///< page: maximum number of fragments
    Provenance provenance{};
    /// PNG, JPEG, TIFF, page: set by the sink unless null.
    std::shared_ptr<DisplayOutcome> outcome{};
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
