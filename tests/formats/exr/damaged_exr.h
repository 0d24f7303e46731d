// SPDX-License-Identifier: Apache-2.0
// Damaged files: truncated, or with bytes changed.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include <peeler/error.h>
#include "formats/exr/exr_readers.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler::test {

/// Reads a layered or deep file `turns` times, each time truncated or with bytes changed. Every
/// time, this must give an Error (kInput) or an image. Returns the number of Errors.
inline int refusalsOfDamaged(const std::filesystem::path& path, std::uint32_t seed, int turns) {
    const std::string good = bytesOf(path);
    std::mt19937 random(seed);
    int refused = 0;
    for (int i = 0; i < turns; ++i) {
        std::string bad = good;
        if (i % 3 == 0) {
            bad.resize(random() % good.size());
        } else {
            // Half of the changes are in the headers and the first chunks, which contain sizes.
            const std::size_t range =
                i % 3 == 1 ? std::min<std::size_t>(4000, bad.size()) : bad.size();
            for (int n = 0; n < 3; ++n)
                bad[random() % range] = static_cast<char>(random());
        }
        std::ofstream(path, std::ios::binary) << bad;
        try {
            const auto reader = openLayered(path);
            LayeredImage image;
            const Window crop = reader->info().plan.view.crop;
            reader->read({crop.x0, crop.y0, crop.x1, std::min(crop.y1, crop.y0 + 64)}, image);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::kInput)
                << "seed " << seed << " turn " << i << ": " << e.what();
            ++refused;
        }
    }
    return refused;
}

}  // namespace peeler::test
