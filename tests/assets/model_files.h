// SPDX-License-Identifier: Apache-2.0
// List of the glTF files in a folder.
#pragma once

#include <algorithm>
#include <filesystem>
#include <vector>

namespace peeler::test {

/// Returns the paths of all .gltf and .glb files below the folder, sorted.
inline std::vector<std::filesystem::path> modelFiles(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const std::filesystem::path extension = entry.path().extension();
        if (entry.is_regular_file() && (extension == ".gltf" || extension == ".glb"))
            files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace peeler::test
