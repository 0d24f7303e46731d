// SPDX-License-Identifier: Apache-2.0
// Output hashes: fingerprints stored in finished files, which show whether a command would write
// the same file again.
#pragma once

#include <string>

#include <peeler/view.h>
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler {

/// Returns the hash (16 hexadecimal digits) of everything that decides a file's pixels and their
/// storage: scene and settings hash, frame, time, camera, size and crop, and the format's options.
/// The version, the renderer and the choice among exact methods do not affect it. Merged tiles get
/// the hash of the whole picture.
std::string outputHash(const View& view, const std::string& path, const OutputOptions& output);

/// Returns the settings of dense planes as text, for example "8 half nan".
std::string denseText(const DenseSettings& dense);

/// Returns the outputHash() of a file made from all layers of another peeler file, with the headers
/// `input`. It equals the hash of the same file made by a render. Returns "" if a render would
/// produce a different file, or if that is unknown.
std::string outputHashFrom(const ExrInfo& input, const View& view, const std::string& path,
                           const OutputOptions& output);

/// Returns the output hash stored in a file written by a Sink (Provenance::output_hash); the
/// extension decides where to look for it. Returns "" if the file is missing, has no hash, is
/// incomplete, or has changed since it was written. For OpenEXR (all files of a set), checks the
/// offset of every chunk, and all bytes against the pixel hash if there is one (exr_integrity.h).
/// Decodes flat images. May throw Error of any kind except kInput.
std::string outputHashOf(const std::string& path);

}  // namespace peeler
