// SPDX-License-Identifier: Apache-2.0
// Header of a Radiance picture (Ward, "Radiance File Formats", "Picture File Format"). OpenImageIO
// reads the pixels, but confuses two of the eight orientations.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace peeler {

struct RadianceHeader {
    /// Orientation of the rows, as in TIFF: 1 = from the top, from the left.
    int orientation = 1;
    /// Settings that change the meaning of values and are ignored here, as in StoredImage::notes.
    std::vector<std::string> notes{};
};

/// Reads the header at the start of `text`, which is the whole file or its first
/// kMostRadianceHeader bytes. Missing settings have their defaults; OpenImageIO rejects files
/// without a resolution.
RadianceHeader radianceHeader(std::string_view text);

/// Headers have a few lines; programs that render in steps add a line each time.
inline constexpr std::size_t kMostRadianceHeader = std::size_t{1} << 16U;

}  // namespace peeler
