// SPDX-License-Identifier: Apache-2.0
// Output hashes: what a finished file says that it was made of, so that a command can tell whether
// it would make the same file again.
#pragma once

#include <string>

#include <peeler/view.h>
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler {

/// The hash, 16 hexadecimal digits, of everything that decides the pixels of a file and how they
/// are stored: scene and settings hash, frame, time, camera, size and crop, and the options of its
/// format. The version, the renderer and the choice among the exact methods do not enter it. Tiles
/// that are merged get the hash of the whole picture.
std::string outputHash(const View& view, const std::string& path, const OutputOptions& output);

/// The settings of planes as one text: "8 half nan".
std::string denseText(const DenseSettings& dense);

/// outputHash() for a file that is made of all layers of another file of ours, whose headers are
/// `input`: the hash that the file would have if it had been rendered. "" if a render would make
/// another file, or if that is not known.
std::string outputHashFrom(const ExrInfo& input, const View& view, const std::string& path,
                           const OutputOptions& output);

/// Provenance::output_hash of a file that a Sink has written, found by the file's extension; "" if
/// there is no such file, it does not say, it is not whole, or it has changed since it was written.
/// Of an OpenEXR file (of a set, of all its files) the place of every chunk is checked, and all
/// bytes are held against its hash, if it has one (exr_integrity.h); flat images are decoded.
/// Throws Error of any kind but kInput.
std::string outputHashOf(const std::string& path);

}  // namespace peeler
