// SPDX-License-Identifier: Apache-2.0
// The options of peeler extract.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <peeler/memory_budget.h>
#include "cmd/cli/report.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_options.h"

namespace peeler::cmd {

class VerbOptions;

struct ExtractOptions {
    std::filesystem::path input;
    LayeredReadOptions reading;
    OutputRequest output;  ///< the request for layers; no layers are written if its path is empty
    std::optional<std::filesystem::path> counts, points, arrays;
    ObjectOptions objects;
    std::vector<int> layers;       ///< indices of layers to extract; empty = all
    std::uint32_t max_layers = 0;  ///< number of layers to extract, nearest first; 0 = all
    bool double_points = false;
    bool dry_run = false;
    int threads = 0;
    MemoryBudget memory;
    ReportOptions report;

    bool writesLayers() const { return !output.path.empty(); }
    bool writesFragments() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addExtractOptions(VerbOptions& verb, ExtractOptions& options);

/// Throws Error (kUsage) if the options contradict each other, and Error (kOutput) if a file cannot
/// be written. Does not need the picture.
void checkExtractOptions(const ExtractOptions& options);

}  // namespace peeler::cmd
