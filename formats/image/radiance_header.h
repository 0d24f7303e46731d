// SPDX-License-Identifier: Apache-2.0
// The header of a Radiance picture (Ward, "Radiance File Formats", "Picture File Format").
//
// It is parsed here because OpenImageIO, which reads the pixels, confuses two of the eight
// orientations.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace peeler {

struct RadianceHeader {
    /// The orientation of the rows, as in TIFF; 1 means top to bottom, left to right.
    int orientation = 1;
    /// Settings that should change the values but are ignored, as clauses like those of
    /// StoredImage::notes.
    std::vector<std::string> notes{};
};

/// Reads the header at the start of `text`, which must be the whole file or at least its first
/// kMostRadianceHeader bytes. Missing settings get their defaults. A missing resolution is no error
/// here: OpenImageIO rejects such files.
RadianceHeader radianceHeader(std::string_view text);

/// The maximum size of a header, in bytes. Most headers have a few lines, but every program that
/// processes the picture may add a line.
inline constexpr std::size_t kMostRadianceHeader = std::size_t{1} << 16U;

}  // namespace peeler
