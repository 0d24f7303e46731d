// SPDX-License-Identifier: Apache-2.0
// The header of a Radiance picture (Ward, "Radiance File Formats", "Picture File Format"):
// OpenImageIO reads the pixels, and takes two of the eight orientations for each other.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace peeler {

struct RadianceHeader {
    /// How the rows lie, as TIFF's tag Orientation has it: 1 = from the top, each from the left.
    int orientation = 1;
    /// Settings that say what the numbers mean and have no effect here, as StoredImage::notes.
    std::vector<std::string> notes{};
};

/// Reads the header at the beginning of `text`, all of the file or as much as a header can have.
/// What is not there is as the default; OpenImageIO refuses files without a resolution.
RadianceHeader radianceHeader(std::string_view text);

/// Headers are a few lines; those that render in steps add a line each time.
inline constexpr std::size_t kMostRadianceHeader = std::size_t{1} << 16U;

}  // namespace peeler
