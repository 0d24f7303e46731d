// SPDX-License-Identifier: Apache-2.0
// Pictures in OpenEXR files of other programs: finds the channels for colour, opacity and depth in
// each part, by the names that renderers use, and chooses the picture to read.
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
    /// Whether the picture has R, G and B, or Y.
    bool complete() const;
    /// Returns the name of the channel for one of colorNames() or for "Z".
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
/// part of peeler's own file, the file is read like another program's from then on. Throws Error
/// (kUsage) for a name that the file does not have. Throws Error (kInput) if there is no picture,
/// or if the part has several layers and no colours of its own. The hint lists the choices.
ExrPicture choosePicture(OpenedExr& opened);

/// Warns about parts that are not read in files of other programs, unless a part was chosen.
void warnOfUnread(OpenedExr& opened, std::span<const std::size_t> read);

/// Makes depths finite, since Z = +inf means a pixel without a fragment. +inf and NaN become the
/// largest float, -inf the lowest. Warns about NaN and -inf.
void makeDepthsFinite(std::span<float> depths, ReadWarnings& warnings);

/// Sets the crop for pixels stored in the window `data`, unless the camera defines it. The crop
/// becomes the display window or, unless `pixels_only`, the union of display window and `data`.
/// Throws Error (kInput), naming `path`, if the display window is too large for the stored pixels.
void placePixels(View& view, const Window& data, bool pixels_only, const std::string& path);

}  // namespace peeler
