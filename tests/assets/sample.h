// SPDX-License-Identifier: Apache-2.0
// Which of the models the short run takes.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {

/// One of the files that differ in nothing but their container (glTF, glTF-Binary, glTF-Embedded),
/// and none of those whose textures take seconds to decode and show nothing that others do not. All
/// of them if everything is asked for. assets/gltf_reader_assets_test.cpp reads every one.
inline std::vector<std::filesystem::path> sampleOf(
    const std::vector<std::filesystem::path>& files) {
    if (exhaustive()) return files;
    const std::set<std::string> containers = {"glTF", "glTF-Binary", "glTF-Embedded"};
    const std::set<std::string> large = {"AlphaBlendModeTest", "StainedGlassLamp"};
    std::set<std::filesystem::path> seen;
    std::vector<std::filesystem::path> sample;
    for (const auto& file : files) {
        const std::filesystem::path folder = file.parent_path(), model = folder.parent_path();
        if (large.contains(model.filename().string())) continue;
        const bool is_container = containers.contains(folder.filename().string());
        if (seen.insert(is_container ? model : file).second) sample.push_back(file);
    }
    return sample;
}

}  // namespace peeler::test
