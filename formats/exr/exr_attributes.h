// SPDX-License-Identifier: Apache-2.0
// What the header of another program's file says besides the pixels: it goes along into OpenEXR
// files that are made of the picture.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>

#include "formats/exr/exr_files.h"

namespace peeler {

/// Sets Provenance::carried to the attributes of a part that stay true of the picture: all but
/// those that say how it is stored, that ours say (formats/README.md, "Attributes"), and, if the
/// camera is known, that follow from it. Warns of what does not go along, and, if only pixels
/// count, of pixels that are not square and primaries that are not those of Rec. 709.
void readCarried(OpenedExr& opened, std::size_t part);

/// Bytes of all attributes together that go along: every part of a file that is written has them.
inline constexpr std::size_t kMostCarried = 1 << 20;

/// Whether an attribute can go along into files of ours, whose camera is known or not: none that
/// these have by themselves, of a value that OpenEXR takes for one of its type.
bool canCarry(const StoredAttribute& stored, bool camera_known);

/// Inserts the attributes, in place of those of the same name.
void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried);

}  // namespace peeler
