// SPDX-License-Identifier: Apache-2.0
// Carried attributes: header attributes of another program's picture. peeler copies them into the
// OpenEXR files that it makes from the picture.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>

#include "formats/exr/exr_files.h"

namespace peeler {

/// Sets Provenance::carried to the attributes of a part that remain true for the picture. Leaves
/// out attributes that describe storage, attributes that peeler sets (formats/README.md,
/// "Attributes"), and, if the camera is known, attributes derived from the camera. Warns about
/// attributes that are not carried and, with `pixels_only`, about pixels that are not square and
/// about primaries other than Rec. 709.
void readCarried(OpenedExr& opened, std::size_t part);

/// The maximum total size of carried attributes, in bytes. Every part of an output file repeats the
/// attributes.
inline constexpr std::size_t kMostCarried = 1 << 20;

/// Whether an attribute can be carried into peeler's files: peeler does not set the attribute
/// itself, and OpenEXR accepts the value for its type. `camera_known`: whether the files' camera is
/// known.
bool canCarry(const StoredAttribute& stored, bool camera_known);

/// Inserts the attributes into a header. Replaces attributes with the same names.
void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried);

}  // namespace peeler
