// SPDX-License-Identifier: Apache-2.0
// Carried attributes: header attributes of another program's picture that peeler copies into the
// OpenEXR files it makes from that picture.
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

/// The maximum total size of carried attributes, in bytes. It is limited because every part of an
/// output file repeats them.
inline constexpr std::size_t kMostCarried = 1 << 20;

/// Whether an attribute can be carried into peeler's files, whose camera is known or not. peeler
/// must not set the attribute itself, and OpenEXR must accept its value for its type.
bool canCarry(const StoredAttribute& stored, bool camera_known);

/// Inserts the attributes into a header. Replaces attributes with the same names.
void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried);

}  // namespace peeler
