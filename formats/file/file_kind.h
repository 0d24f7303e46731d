// SPDX-License-Identifier: Apache-2.0
// What a file is, told by how it begins and not by its name.
#pragma once

#include <string>

namespace peeler {

enum class FileKind { kUnknown, kGltf, kExr, kPng, kJpeg, kTiff, kHdr };

/// Reads the first bytes. Throws Error (kInput) if the file cannot be read.
FileKind fileKind(const std::string& path);

}  // namespace peeler
