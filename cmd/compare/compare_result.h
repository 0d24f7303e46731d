// SPDX-License-Identifier: Apache-2.0
// What a comparison found, against its thresholds, as a table and as JSON.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/image/difference.h"

namespace peeler::cmd {

/// How far two pictures may be apart. Colours must be identical if none of the three limits of
/// colour is given; otherwise only those that are given count.
struct Thresholds {
    std::uint64_t max_count = 0;  ///< pixels whose number of fragments may differ
    double max_depth = 0;         ///< scene units
    /// Of linear premultiplied colour; the last in dB.
    std::optional<double> max_color, max_rmse, min_psnr;
};

/// One threshold that applies, and what was found.
struct ThresholdResult {
    std::string option, what;
    double limit = 0, found = 0;
    bool exceeded = false;
};

struct HeatmapResult {
    std::string path;
    double color = 0;         ///< colour difference at the end of the ramp
    std::uint32_t count = 0;  ///< largest difference of fragment counts
};

struct ComparedFile {
    std::string path;
    bool layered = false;
    std::uint64_t layers = 0;
};

struct Comparison {
    ComparedFile a, b;
    int width = 0, height = 0;     ///< pixels compared
    bool by_layer = false;         ///< fragments with fragments; else composite with composite
    LayeredDifference difference;  ///< only `pixels` and `composite` unless by_layer

    /// The colours that thresholds apply to.
    const DifferenceStatistics& color() const {
        return by_layer ? difference.all.color : difference.composite;
    }
    bool identical() const;
};

/// Every threshold that applies to the comparison.
std::vector<ThresholdResult> judge(const Comparison& comparison, const Thresholds& thresholds);

/// The comparison as lines for people.
std::string toText(const Comparison& comparison, const std::optional<HeatmapResult>& heatmap);

/// The comparison as JSON (cmd/README.md, "JSON"). Infinite numbers are the strings "inf" and
/// "-inf".
nlohmann::ordered_json toJson(const Comparison& comparison,
                              const std::vector<ThresholdResult>& thresholds,
                              const std::optional<HeatmapResult>& heatmap);

/// "beyond --max-color 0.01: the largest difference of colour is 0.5"
std::string toText(const ThresholdResult& result);

}  // namespace peeler::cmd
