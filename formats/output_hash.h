// SPDX-License-Identifier: Apache-2.0
// Output hashes: fingerprints stored in output files. They show whether a command would write the
// same file again.
#pragma once

#include <string>

#include <peeler/view.h>
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler {

/// Returns the hash (16 hexadecimal digits) of everything that decides a file's pixels and their
/// storage: scene and settings hash, frame, time, camera, size and crop, and the format's options.
/// The version, the renderer and the choice among exact methods do not affect the hash. Merged
/// tiles get the hash of the whole picture.
std::string outputHash(const View& view, const std::string& path, const OutputOptions& output);

/// Returns the settings of dense planes as text, for example "8 half nan".
std::string denseText(const DenseSettings& dense);

/// Returns the outputHash() of a file made from all layers of another peeler file, with the headers
/// `input`. The hash equals that of the same file made by a render. Returns "" if a render would
/// make a different file, or if that is unknown.
std::string outputHashFrom(const ExrInfo& input, const View& view, const std::string& path,
                           const OutputOptions& output);

/// Returns the output hash stored in a file by a Sink (Provenance::output_hash). The extension
/// decides where the hash is stored. Returns "" if the file is missing, has no hash, is incomplete,
/// or has changed since it was written. For OpenEXR (all files of a set), checks the offset of
/// every chunk, and all bytes against the pixel hash if there is one (exr_integrity.h). Decodes
/// flat images. May throw Error of any kind except kInput.
std::string outputHashOf(const std::string& path);

}  // namespace peeler
