// SPDX-License-Identifier: Apache-2.0
// Pictures in OpenEXR files of other programs: the channels for colour, opacity and depth in each
// part, found by the names that renderers use, and the choice of the picture to read.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "formats/exr/exr_files.h"

namespace peeler {

/// The names of a picture's channels in its part; "" if missing.
struct ExrColors {
    std::array<std::string, 3> rgb;      ///< names of R, G, B
    std::string alpha;                   ///< name of A
    std::array<std::string, 3> opacity;  ///< names of AR, AG, AB: all present, or all missing
    std::string depth;                   ///< name of Z, which has type half or float
    std::string depth_back;              ///< name of ZBack
    std::string luminance;               ///< name of Y, if R, G and B are all missing
    std::array<std::string, 2> chroma;   ///< names of RY and BY: both present, or both missing

    bool tinted() const { return !opacity[0].empty(); }
    bool colored() const { return !luminance.empty() || rgb != std::array<std::string, 3>{}; }
    bool complete() const;
    /// Returns the name of a component's channel. `component` is one of colorNames(), or "Z".
    const std::string& named(std::string_view component) const;
};

/// A picture in a file: a whole part, or a layer of channels in it.
struct ExrPicture {
    std::size_t part = 0;  ///< index in ExrInfo::parts
    /// "beauty" if the channels are named beauty.R and so on; "" if the picture is the whole part.
    std::string layer{};
    std::string view{};  ///< "" if the file has no views
    ExrColors colors{};
};

/// Returns the picture that the options choose; by default, the picture of the first part with
/// colours and, in a deep file, depth. Warns about views that are not read. If the options choose a
/// part of a file by peeler, the file is read like another program's from then on. Throws Error
/// (kUsage) if the file lacks a part or view that the options name. Throws Error (kInput), with a
/// hint that lists the choices, if there is no picture, or if the part has several layers and no
/// colours of its own.
ExrPicture choosePicture(OpenedExr& opened);

/// Warns about parts that are not read. Does not warn if the file is by peeler or if a part was
/// chosen.
void warnOfUnread(OpenedExr& opened, std::span<const std::size_t> read);

/// Makes depths finite, since Z = +inf means a pixel without a fragment. +inf and NaN become the
/// largest float, -inf the lowest. Warns about NaN and -inf.
void makeDepthsFinite(std::span<float> depths, ReadWarnings& warnings);

/// Sets the crop for pixels stored in the window `data`, unless the camera defines the crop. The
/// crop becomes the display window if `pixels_only`, else the union of the display window and
/// `data`. Throws Error (kInput), naming `path`, if the display window is too large for the stored
/// pixels.
void placePixels(View& view, const Window& data, bool pixels_only, const std::string& path);

}  // namespace peeler
