// SPDX-License-Identifier: Apache-2.0
// What a file is, by its name or by how it begins; and where the numbers of frames and views go in
// a name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// The extension with its dot, A to Z as a to z, whatever the locale: ".exr" of "OUT.EXR".
std::string lowerExtension(const std::filesystem::path& path);

/// Whether a file name has a place for the frame's number: "####" or "%04d".
bool hasFrameToken(const std::string& path);

/// The name with the frame's number in it: as many digits as there are '#' (a lone one stands for
/// four), or as printf does for "%04d" and "%d"; "%%" is a '%'. A sign comes before the digits.
/// Only the last component of the path is looked at.
std::string framePath(const std::string& path, int frame);

/// The numbers, from 0 to 1,000,000,000 and rising, for which framePath() names something that is
/// there; 0 if there is no place for a number, and something of that name is there. Throws Error
/// (kOutput) where that cannot be told.
std::vector<int> framesThere(const std::string& path);

/// Whether a file name has a place for the number of a view: "@@@@".
bool hasViewToken(const std::string& path);

/// The name with the number of a view in it, from 0 on: as many digits as there are '@' (a lone one
/// stands for four). Only the last component of the path is looked at.
std::string viewPath(const std::string& path, int view);

enum class FileKind { kUnknown, kGltf, kExr, kPng, kJpeg, kTiff, kHdr, kSafetensors };

/// Whether a file of so many bytes that begins with these (9 are enough) is a .safetensors: a
/// length of 8 bytes, and a header of JSON that is as long and no longer than the format allows
/// (100 MB).
bool isSafetensors(std::string_view begin, std::uint64_t size);

/// The kind of a file by its first bytes. Throws Error (kInput) if the file cannot be read.
FileKind fileKind(const std::string& path);

}  // namespace peeler
