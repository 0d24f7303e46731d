// SPDX-License-Identifier: Apache-2.0
// File names and kinds: recognition by extension or first bytes, and number placeholders for frames
// and views.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// Returns the extension with its dot, in lower case (A to Z only, in any locale): ".exr" for
/// "OUT.EXR".
std::string lowerExtension(const std::filesystem::path& path);

/// Whether a file name has a placeholder for the frame number: "####" or "%04d".
bool hasFrameToken(const std::string& path);

/// Returns the name with the frame number inserted: for '#', one digit per character (a single '#'
/// means four digits); for "%04d" and "%d", as printf would; "%%" becomes '%'. A minus sign comes
/// before the digits. Only the last component of the path is changed.
std::string framePath(const std::string& path, int frame);

/// Returns the path with the frame number in place of the first placeholder only.
std::string firstFramePath(const std::string& path, int frame);

/// The numbers in the name of a file; 0 where the name has no placeholder.
struct FileNumbers {
    int frame = 0, view = 0;
};

/// Returns the numbers, from 0 to 1,000,000,000, that turn `path` into an existing file's path when
/// inserted by viewPath() and framePath(), in rising order. Throws Error (kOutput) if existence
/// cannot be determined.
std::vector<FileNumbers> numbersThere(const std::string& path);

/// Returns the frame numbers from 0 to 1,000,000,000 whose framePath() exists, in rising order. For
/// a path without placeholder, returns {0} if the file exists. Throws Error (kOutput) if existence
/// cannot be determined.
std::vector<int> framesThere(const std::string& path);

/// Whether a file name has a placeholder for the view number: "@@@@".
bool hasViewToken(const std::string& path);

/// Returns the name with the view number (from 0) inserted, one digit per '@' (a single '@' means
/// four digits). Only the last component of the path is changed.
std::string viewPath(const std::string& path, int view);

enum class FileKind { kUnknown, kGltf, kExr, kPng, kJpeg, kTiff, kHdr, kSafetensors };

/// Whether a file that has this size and begins with these bytes (9 are enough) is a .safetensors
/// file: an 8-byte length, then a JSON header of that length. The header must end within the file,
/// and must not be longer than the format allows (100 MB).
bool isSafetensors(std::string_view begin, std::uint64_t size);

/// Returns the kind of a file by its first bytes. Throws Error (kInput) if the file cannot be read.
FileKind fileKind(const std::string& path);

}  // namespace peeler
