// SPDX-License-Identifier: Apache-2.0
// Writes a finished picture with the writers that take layers.
#pragma once

#include <string>

#include "core/image/composite.h"
#include "formats/writers.h"

namespace peeler {

/// Writes the picture to `path`, whole or not at all, in the flat format of its extension. The
/// window becomes the picture. Throws like makeSink() and the sink.
void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options);

}  // namespace peeler
