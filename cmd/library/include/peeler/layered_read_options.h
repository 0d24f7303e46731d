// SPDX-License-Identifier: Apache-2.0
// OpenEXR reading options.
#pragma once

#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The choice of a picture in an OpenEXR file. A file written by peeler holds one picture. Other
/// files may hold several, as parts, channel layers (beauty.R, beauty.G, …) and views (left,
/// right).
struct LayeredReadOptions {
    bool strict = false;  ///< whether a warning becomes an Error (kInput)
    std::string part{};   ///< name of a part or channel layer; "" = the first that has colours
    std::string view{};   ///< name of a view; "" = the file's default
    /// Whether the output stores neither header attributes nor pixels outside the display window.
    /// If so, the reader skips pixels outside the display window, and warns if the colours are not
    /// Rec. 709 (chromaticities) or the pixels are not square (pixelAspectRatio).
    bool pixels_only = false;

    bool choosesPicture() const { return !part.empty() || !view.empty(); }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
