// SPDX-License-Identifier: Apache-2.0
// Carried attributes: header attributes of another program's file that are copied into OpenEXR
// files made from its picture.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>

#include "formats/exr/exr_files.h"

namespace peeler {

/// Sets Provenance::carried to the attributes of a part that remain true for the picture: all but
/// those that describe its storage, those that our files set themselves (formats/README.md,
/// "Attributes"), and, if the camera is known, those that follow from it. Warns of attributes that
/// are not carried, and, with `pixels_only`, of pixels that are not square and primaries other than
/// Rec. 709.
void readCarried(OpenedExr& opened, std::size_t part);

/// The maximum total size of carried attributes, in bytes; every part of an output file has them.
inline constexpr std::size_t kMostCarried = 1 << 20;

/// Whether an attribute can be carried into our files with a known or unknown camera: our files do
/// not set it themselves, and OpenEXR accepts its value for its type.
bool canCarry(const StoredAttribute& stored, bool camera_known);

/// Inserts the attributes, replacing those of the same name.
void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried);

}  // namespace peeler
