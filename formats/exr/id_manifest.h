// SPDX-License-Identifier: Apache-2.0
// The names of ids as OpenEXR 3 stores them: the attribute idManifest.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>
#include <span>

#include "core/scene/scene.h"

namespace peeler {

/// Adds the names of those channels of the header that are an id.object or id.material of some
/// layer (scheme "id", not hashed, stable as long as the scene file is); nothing if there are none.
void addIdManifest(Imf::Header& header, const IdNames& names);

/// The inverse, from the bytes of the attribute. Nothing for channels that are not there. Throws
/// Error (kInput) if the bytes are damaged or implausible.
IdNames idNamesFromManifest(std::span<const std::byte> attribute);

}  // namespace peeler
