// SPDX-License-Identifier: Apache-2.0
// Comparison results, judged against thresholds, as a table and as JSON.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/image/difference.h"

namespace peeler::cmd {

/// The allowed differences between two pictures. If none of the three colour limits is given,
/// colours must be identical; otherwise only the given limits apply.
struct Thresholds {
    std::uint64_t max_count = 0;  ///< number of pixels whose fragment counts may differ
    double max_depth = 0;         ///< scene units
    /// Limits for linear premultiplied colour; min_psnr is in dB.
    std::optional<double> max_color, max_rmse, min_psnr;
};

/// A threshold that applies to the comparison, with the measured value.
struct ThresholdResult {
    std::string option, what;
    double limit = 0, found = 0;
    bool exceeded = false;
};

struct HeatmapResult {
    std::string path;
    double color = 0;         ///< the colour difference at the top of the colour ramp
    std::uint32_t count = 0;  ///< the largest difference in fragment counts
};

struct ComparedFile {
    std::string path;
    bool layered = false;
    std::uint64_t layers = 0;
};

struct Comparison {
    ComparedFile a, b;
    int width = 0, height = 0;     ///< size of the compared window, pixels
    bool by_layer = false;         ///< whether fragments are compared, rather than composites
    LayeredDifference difference;  ///< if by_layer is false, only `pixels` and `composite` are set

    /// Returns the statistics of colour differences to which the thresholds apply.
    const DifferenceStatistics& color() const {
        return by_layer ? difference.all.color : difference.composite;
    }
    bool identical() const;
};

/// Returns the result for every threshold that applies to the comparison.
std::vector<ThresholdResult> judge(const Comparison& comparison, const Thresholds& thresholds);

std::string toText(const Comparison& comparison, const std::optional<HeatmapResult>& heatmap);

/// Returns the comparison as JSON (cmd/README.md, "JSON"). Infinite numbers are the strings "inf"
/// and "-inf".
nlohmann::ordered_json toJson(const Comparison& comparison,
                              const std::vector<ThresholdResult>& thresholds,
                              const std::optional<HeatmapResult>& heatmap);

/// Returns a result as text: "beyond --max-color 0.01: the largest difference of colour is 0.5".
std::string toText(const ThresholdResult& result);

}  // namespace peeler::cmd
