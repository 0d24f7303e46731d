// SPDX-License-Identifier: Apache-2.0
// The options of reading an OpenEXR file.
#pragma once

#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Chooses the picture that is read of an OpenEXR file. Peeler's own files are one picture; files
/// of other programs may hold several, in parts, in layers of channels (beauty.R, beauty.G, …) and
/// as views (left, right).
struct LayeredReadOptions {
    bool strict = false;  ///< a warning is an Error (kInput)
    std::string part{};   ///< the name of a part, or of a layer; "" = the first that has colours
    std::string view{};   ///< "" = the file's default
    /// The result has neither a header nor pixels outside the display window: those pixels are not
    /// read, and what the header says of the others is a warning.
    bool pixels_only = false;

    bool choosesPicture() const { return !part.empty() || !view.empty(); }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
