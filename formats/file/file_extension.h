// SPDX-License-Identifier: Apache-2.0
// What a file's name says that it is.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// The extension with its dot, A to Z as a to z, whatever the locale: ".exr" of "OUT.EXR".
inline std::string lowerExtension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

}  // namespace peeler
