// SPDX-License-Identifier: Apache-2.0
// Real models without animations, skins and morph targets, and with only a few known extensions.
#pragma once

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace peeler::test {

/// Returns the models of gltf-sample-assets (listed in its MODELS.tsv) that have no animation, skin
/// or morph target, and no extensions other than `known`. Adds the example scenes.
inline std::vector<std::filesystem::path> staticModels(const std::filesystem::path& assets) {
    const std::set<std::string> known = {"KHR_mesh_quantization", "KHR_texture_transform",
                                         "KHR_materials_unlit", "KHR_xmp"};
    std::ifstream table(assets / "MODELS.tsv");
    std::string line;
    std::getline(table, line);
    std::vector<std::string> names;
    std::istringstream header(line);
    for (std::string name; std::getline(header, name, '\t');)
        names.push_back(name);

    std::vector<std::filesystem::path> models;
    while (std::getline(table, line)) {
        std::istringstream row(line);
        std::string cell;
        bool is_static = true, sample = false;
        std::string path;
        for (std::size_t i = 0; i < names.size(); ++i) {
            cell.clear();
            std::getline(row, cell, '\t');
            if (names[i] == "path") path = cell;
            if (names[i] == "animations" || names[i] == "skins" || names[i] == "max_morph_targets")
                is_static = is_static && (cell.empty() || cell == "0");
            if (names[i] == "extensionsUsed") {
                std::istringstream extensions(cell);
                for (std::string e; std::getline(extensions, e, ',');)
                    is_static = is_static && known.contains(e);
            }
        }
        sample = path.starts_with("gltf-sample-assets/");
        if (is_static && sample) models.push_back(assets / path);
    }
    return models;
}

}  // namespace peeler::test
