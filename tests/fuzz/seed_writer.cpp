// SPDX-License-Identifier: Apache-2.0
// Writes the seeds of all targets: write_seeds FOLDER makes FOLDER/TARGET/seed_N.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "fuzz/seeds.h"

int main(int count, char** arguments) {
    if (count != 2) {
        std::fprintf(stderr, "usage: write_seeds FOLDER\n");
        return 2;
    }
    for (const auto& [target, inputs] : peeler::fuzz::allSeeds()) {
        const std::filesystem::path folder = std::filesystem::path(arguments[1]) / target;
        std::filesystem::create_directories(folder);
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            std::ofstream file(folder / ("seed_" + std::to_string(i)), std::ios::binary);
            file.write(reinterpret_cast<const char*>(inputs[i].data()),
                       static_cast<std::streamsize>(inputs[i].size()));
            if (!file) return 1;
        }
    }
    return 0;
}
