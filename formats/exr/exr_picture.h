// SPDX-License-Identifier: Apache-2.0
// The pictures of an OpenEXR file by another program: which channels of which part are colours,
// opacity and depth, by the names that renderers give them, and which of the pictures is read.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "formats/exr/exr_files.h"

namespace peeler {

/// The channels of a picture by their names in the part; "" = there is none.
struct ExrColors {
    std::array<std::string, 3> rgb;      ///< R, G, B
    std::string alpha;                   ///< A
    std::array<std::string, 3> opacity;  ///< AR, AG, AB: all or none
    std::string depth;                   ///< Z, half or float
    std::string depth_back;              ///< ZBack
    std::string luminance;               ///< Y, if there is none of R, G, B
    std::array<std::string, 2> chroma;   ///< RY and BY of Y: both or none

    bool tinted() const { return !opacity[0].empty(); }
    bool colored() const { return !luminance.empty() || rgb != std::array<std::string, 3>{}; }
    bool complete() const;  ///< R, G and B, or Y
    /// The channel that is this one of colorNames(), or "Z".
    const std::string& named(std::string_view component) const;
};

/// A picture: a part, or a layer of channels in it.
struct ExrPicture {
    std::size_t part = 0;  ///< in ExrInfo::parts
    std::string layer{};   ///< "beauty" of beauty.R; "" = the part itself
    std::string view{};    ///< "" = the file names no views
    ExrColors colors{};
};

/// The picture that the options ask for; without any, that of the first part that has colours and,
/// in a deep file, depth. Warns of views that are not read. A chosen part of a file of ours is one
/// of a file by others from then on. Throws Error (kUsage) for a name that it does not have,
/// (kInput) if there is no picture, or the part has several layers and is none itself; the hint
/// lists what can be chosen.
ExrPicture choosePicture(OpenedExr& opened);

/// Warns of parts that are not read, in files of other programs; not where a part was chosen.
void warnOfUnread(OpenedExr& opened, std::span<const std::size_t> read);

/// Makes depths numbers, since Z = +inf means that a pixel has no fragment: +inf becomes the
/// largest one; NaN does, too, and -inf becomes the least, with a warning.
void makeDepthsFinite(std::span<float> depths, ReadWarnings& warnings);

/// Sets the crop for pixels that are stored in `data`, unless the camera says it: the display
/// window, and with it all of `data` unless only pixels count. Throws Error (kInput), naming
/// `path`, if the display window is too large for what is stored.
void placePixels(View& view, const Window& data, bool pixels_only, const std::string& path);

}  // namespace peeler
