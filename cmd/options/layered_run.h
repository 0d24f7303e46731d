// SPDX-License-Identifier: Apache-2.0
// Run of a verb that makes one picture from layered files.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "core/base/stage_times.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// Options of every such verb, besides its inputs.
struct LayeredRunOptions {
    LayeredReadOptions reading{};
    int threads = 0;
    OutputRequest output{};
    ReportOptions report{};
};

/// The state of a run, with the common part of each stage. A verb calls, in this order:
/// checkFiles(), open() or openInput(), forEachBand(), write(), report().
class LayeredRun {
  public:
    /// Applies the report options and starts the total time. `options` must outlive the run.
    LayeredRun(const LayeredRunOptions& options, std::vector<std::filesystem::path> inputs,
               Reporter& reporter);

    /// Checks the names of output files, and sets the threads. Throws Error (kUsage) like
    /// checkOutput() and checkReport().
    void checkFiles() const;

    /// Calls `open_input(LayeredReadOptions)` with options for the output, and returns its result.
    template <class OpenInput>
    auto open(OpenInput&& open_input) {
        return timed(result.milliseconds, "load",
                     [&] { return open_input(readingFor(options_.reading, {{output.path}})); });
    }
    /// Opens the only input, restricted to these objects. Sets `plan` to its plan.
    std::unique_ptr<LayeredInput> openInput(const ObjectOptions& objects);

    /// Iterates over `plan`, like forEachBand() of layered_bands.h.
    template <class Read, class Take>
    void forEachBand(const Stage& stage, int rows, Read&& read, Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(plan.view.crop, rows, result.milliseconds, progress, read, take);
    }
    /// Iterates over the nearest `max_layers` layers of an input, 0 = all.
    template <class Take>
    void forEachBand(const Stage& stage, LayeredInput& input, std::uint32_t max_layers,
                     Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(input, max_layers, result.milliseconds, progress, take);
    }

    /// Returns the output options for an input with this provenance, with this version of peeler.
    OutputOptions outputOptions(Provenance provenance) const;
    /// Writes `plan` to a sink; `fill()` writes the bands.
    template <class Fill>
    void write(Sink& sink, Fill&& fill) {
        sink.begin(plan);
        fill();
        sink.finish();
        add(result.milliseconds, sink.times());
    }

    /// Stops the total time and reports the picture. Throws Error (kOutput) if a file is missing.
    void report(const OutputOptions& written, const Provenance& provenance);

    OutputRequest output;  ///< the request, with the verb's own choices
    Plan plan;             ///< of the output
    PictureResult result;

  private:
    const LayeredRunOptions& options_;
    Reporter& reporter_;
    std::optional<StageTimer> total_;
};

}  // namespace peeler::cmd
