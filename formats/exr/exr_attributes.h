// SPDX-License-Identifier: Apache-2.0
// Carried attributes: header attributes of another program's picture that peeler copies into the
// OpenEXR files it makes from that picture.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>

#include "formats/exr/exr_files.h"

namespace peeler {

/// Sets Provenance::carried to those attributes of a part that remain true for the picture. It
/// leaves out those that describe storage, those that our files set themselves (formats/README.md,
/// "Attributes"), and, if the camera is known, those that follow from it. Warns of attributes that
/// are not carried and, with `pixels_only`, of pixels that are not square and of primaries other
/// than Rec. 709.
void readCarried(OpenedExr& opened, std::size_t part);

/// The maximum total size of carried attributes, in bytes; limited because every part of an output
/// file repeats them.
inline constexpr std::size_t kMostCarried = 1 << 20;

/// Whether an attribute can be carried into our files, whose camera is known or not: our files must
/// not set the attribute themselves, and OpenEXR must accept its value for its type.
bool canCarry(const StoredAttribute& stored, bool camera_known);

/// Inserts the attributes into a header, replacing those with the same names.
void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried);

}  // namespace peeler
