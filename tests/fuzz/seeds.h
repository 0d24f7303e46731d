// SPDX-License-Identifier: Apache-2.0
// Fuzzing seeds: small inputs for every target, made by the product's writers and the tests'
// builders.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace peeler::fuzz {

using SeedBytes = std::vector<std::uint8_t>;

/// The inputs of each target, by the target's name.
using Seeds = std::map<std::string, std::vector<SeedBytes>>;

void addMeshSeeds(Seeds& seeds);
void addSceneSeeds(Seeds& seeds);
void addSplatSeeds(Seeds& seeds);
void addPictureSeeds(Seeds& seeds);
void addKtx2Seeds(Seeds& seeds);
void addTableSeeds(Seeds& seeds);
void addTextSeeds(Seeds& seeds);

inline Seeds allSeeds() {
    Seeds seeds;
    addMeshSeeds(seeds);
    addSceneSeeds(seeds);
    addSplatSeeds(seeds);
    addPictureSeeds(seeds);
    addKtx2Seeds(seeds);
    addTableSeeds(seeds);
    addTextSeeds(seeds);
    return seeds;
}

inline SeedBytes seedOf(const std::string& text) {
    return {text.begin(), text.end()};
}

}  // namespace peeler::fuzz
