// SPDX-License-Identifier: Apache-2.0
// OpenEXR reading options.
#pragma once

#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The picture to read from an OpenEXR file. Peeler's own files hold one picture. Other files may
/// hold several, as parts, channel layers (beauty.R, beauty.G, …) and views (left, right).
struct LayeredReadOptions {
    bool strict = false;  ///< warnings become an Error (kInput)
    std::string part{};   ///< name of a part or layer; "" = the first with colours
    std::string view{};   ///< "" = the file's default
    /// The output has neither a header nor pixels outside the display window: such pixels are not
    /// read, and header attributes that matter for the others (chromaticities, pixelAspectRatio)
    /// cause a warning.
    bool pixels_only = false;

    bool choosesPicture() const { return !part.empty() || !view.empty(); }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
