// SPDX-License-Identifier: Apache-2.0
// OpenEXR reading options.
#pragma once

#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Selects the picture to read from an OpenEXR file. A file written by peeler holds one picture.
/// Other files may hold several, as parts, channel layers (beauty.R, beauty.G, …) and views (left,
/// right).
struct LayeredReadOptions {
    bool strict = false;  ///< whether a warning becomes an Error (kInput)
    std::string part{};   ///< name of a part or layer; "" = the first that has colours
    std::string view{};   ///< name of a view; "" = the file's default
    /// Whether the output format has neither a header nor pixels outside the display window. If so,
    /// pixels outside the display window are not read, and header attributes that affect the other
    /// pixels (chromaticities, pixelAspectRatio) cause a warning.
    bool pixels_only = false;

    bool choosesPicture() const { return !part.empty() || !view.empty(); }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
