// SPDX-License-Identifier: Apache-2.0
// What a finished file says that it was made of, for whoever would make it again.
#pragma once

#include <string>

#include "core/scene/view.h"
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler {

/// What decides the pixels of a file and how they are stored: scene and settings hash, frame, time,
/// camera, size and crop, and what its format's writer is told. Not: the version, the renderer and
/// which of the exact methods it is. Tiles that are merged get the whole picture's.
std::string outputHash(const View& view, const std::string& path, const OutputOptions& output);

/// The same of a file that is made of all layers of another one of ours, whose headers are
/// `input`, where a render would have made it, too; "" where that is not known.
std::string outputHashFrom(const ExrInfo& input, const View& view, const std::string& path,
                           const OutputOptions& output);

/// Provenance::output_hash of a file that a Sink has written, by the file's extension; "" if there
/// is no such file, it does not say, or it is not whole. Of an OpenEXR file the headers are read
/// and every chunk's place is checked (of a set, those of all files); flat images are decoded.
std::string outputHashOf(const std::string& path);

}  // namespace peeler
