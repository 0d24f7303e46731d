// SPDX-License-Identifier: Apache-2.0
// Runs every fuzz target on its seeds, on mutations of the seeds, and on earlier findings, as a
// plain test without libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>

#include "fuzz/fuzz_target.h"
#include "fuzz/seeds.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

/// Mutates inputs like damage, editors and bad exporters. The same seed gives the same mutations.
class Mutator {
  public:
    explicit Mutator(std::uint64_t seed) : random_(seed) {}

    std::size_t below(std::size_t count) { return random_() % count; }

    fuzz::SeedBytes mutated(fuzz::SeedBytes bytes, const fuzz::SeedBytes& other) {
        for (std::size_t steps = 1 + below(4); steps > 0 && !bytes.empty(); --steps)
            mutate(bytes, other);
        return bytes;
    }

  private:
    void mutate(fuzz::SeedBytes& bytes, const fuzz::SeedBytes& other) {
        const std::size_t at = below(bytes.size());
        const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        const auto end = place + static_cast<std::ptrdiff_t>(
                                     below(std::min<std::size_t>(bytes.size() - at, 64)) + 1);
        switch (below(7)) {
            case 0:
                *place ^= static_cast<std::uint8_t>(1U << below(8));
                break;
            case 1:
                *place = static_cast<std::uint8_t>(below(256));
                break;
            case 2:
                overwrite(bytes, at);
                break;
            case 3:
                bytes.erase(place, end);
                break;
            case 4:
                bytes.resize(at);
                break;
            case 5: {
                const fuzz::SeedBytes copy(place, end);
                bytes.insert(place, copy.begin(), copy.end());
                break;
            }
            default:
                if (!other.empty())
                    std::copy_n(other.begin(), std::min(other.size(), bytes.size() - at), place);
        }
    }

    /// Overwrites bytes with a number that is critical for limits, signs or sizes.
    void overwrite(fuzz::SeedBytes& bytes, std::size_t at) {
        static constexpr std::array<std::uint64_t, 8> kNumbers = {
            0, 1, 0x7F, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, ~std::uint64_t{0}};
        const std::uint64_t number = kNumbers[below(kNumbers.size())];
        const std::size_t size = std::min(std::size_t{1} << below(4), bytes.size() - at);
        for (std::size_t i = 0; i < size; ++i)
            bytes[at + i] = static_cast<std::uint8_t>(number >> (8 * i));
    }

    std::mt19937_64 random_;
};

/// Returns the number of mutations for a target: per format, 2,000, or 40 in the short run.
std::size_t mutationsOf(const fuzz::Target& target) {
    const std::string_view name = target.name;
    const std::size_t formats = name == "meshes" ? 3 : name == "splats" ? 4 : 1;
    return formats * (test::exhaustive() ? 2000 : 40);
}

class Fuzz : public testing::TestWithParam<fuzz::Target> {
  protected:
    static const std::vector<fuzz::SeedBytes>& seeds() {
        static const fuzz::Seeds all = fuzz::allSeeds();
        return all.at(GetParam().name);
    }
    static void take(const fuzz::SeedBytes& bytes) {
        EXPECT_NO_THROW(fuzz::attempt([&] { GetParam().take(bytes); }));
    }
};

TEST_P(Fuzz, TakesItsSeeds) {
    for (std::size_t i = 0; i < seeds().size(); ++i) {
        SCOPED_TRACE("seed " + std::to_string(i));
        take(seeds()[i]);
    }
}

TEST_P(Fuzz, TakesMutationsOfItsSeeds) {
    const char* const given = std::getenv("PEELER_TEST_SEED");
    // The short run decides whether a change is merged, so its results must be repeatable.
    const std::uint64_t seed = given                ? std::stoull(given)
                               : test::exhaustive() ? std::random_device{}()
                                                    : 1;
    std::cout << "PEELER_TEST_SEED=" << seed << '\n';
    Mutator mutator(seed);
    for (std::size_t i = 0; i < mutationsOf(GetParam()); ++i) {
        SCOPED_TRACE("mutation " + std::to_string(i));
        const fuzz::SeedBytes& other = seeds()[mutator.below(seeds().size())];
        take(mutator.mutated(seeds()[i % seeds().size()], other));
    }
}

TEST_P(Fuzz, TakesWhatItOnceFound) {
    const fs::path folder = test::sourceDir() / "tests/fuzz/corpus" / GetParam().name;
    if (!fs::exists(folder)) return;  // no findings so far
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        SCOPED_TRACE(entry.path().string());
        const std::string bytes = test::bytesOf(entry.path());
        EXPECT_FALSE(bytes.empty());
        take(fuzz::seedOf(bytes));
    }
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, testing::ValuesIn(fuzz::targets()),
                         [](const auto& row) { return std::string(row.param.name); });

}  // namespace
}  // namespace peeler
