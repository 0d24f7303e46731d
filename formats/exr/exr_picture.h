// SPDX-License-Identifier: Apache-2.0
// Pictures in OpenEXR files of other programs: the channels for colour, opacity and depth in each
// part, by the names that renderers use, and the choice of the picture to read.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "formats/exr/exr_files.h"

namespace peeler {

/// A picture's channels by their names in the part; "" = missing.
struct ExrColors {
    std::array<std::string, 3> rgb;      ///< R, G, B
    std::string alpha;                   ///< A
    std::array<std::string, 3> opacity;  ///< AR, AG, AB: all or none
    std::string depth;                   ///< Z, half or float
    std::string depth_back;              ///< ZBack
    std::string luminance;               ///< Y, if R, G and B are all missing
    std::array<std::string, 2> chroma;   ///< RY and BY: both or none

    bool tinted() const { return !opacity[0].empty(); }
    bool colored() const { return !luminance.empty() || rgb != std::array<std::string, 3>{}; }
    bool complete() const;  ///< R, G and B, or Y
    /// Returns the channel for one of colorNames(), or for "Z".
    const std::string& named(std::string_view component) const;
};

/// A picture: a part, or a layer of channels in it.
struct ExrPicture {
    std::size_t part = 0;  ///< in ExrInfo::parts
    std::string layer{};   ///< "beauty" of beauty.R; "" = the part itself
    std::string view{};    ///< "" = the file has no views
    ExrColors colors{};
};

/// Returns the picture chosen by the options; by default, that of the first part with colours and,
/// in a deep file, depth. Warns of views that are not read. Choosing a part of our own file makes
/// it count as another program's file. Throws Error (kUsage) for a name that the file does not
/// have, (kInput) if there is no picture, or the part has several layers and no colours of its own;
/// the hint lists the choices.
ExrPicture choosePicture(OpenedExr& opened);

/// Warns of parts that are not read, in files of other programs, unless a part was chosen.
void warnOfUnread(OpenedExr& opened, std::span<const std::size_t> read);

/// Makes depths finite, since Z = +inf means that a pixel has no fragment: +inf and NaN become the
/// largest float, -inf the lowest; warns of NaN and -inf.
void makeDepthsFinite(std::span<float> depths, ReadWarnings& warnings);

/// Sets the crop for pixels stored in `data`, unless the camera defines it: the display window,
/// united with `data` unless `pixels_only`. Throws Error (kInput), naming `path`, if the display
/// window is too large for the stored pixels.
void placePixels(View& view, const Window& data, bool pixels_only, const std::string& path);

}  // namespace peeler
