// SPDX-License-Identifier: Apache-2.0
// A run of a verb that makes one picture from layered files.
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

/// The options common to verbs that make one picture from layered files. Each verb adds its inputs.
struct LayeredRunOptions {
    LayeredReadOptions reading{};
    int threads = 0;
    OutputRequest output{};
    ReportOptions report{};
};

/// The state of a run, and steps common to these verbs. A verb calls, in this order: checkFiles(),
/// open() or openInput(), forEachBand(), write(), report().
class LayeredRun {
  public:
    /// Applies the report options and starts measuring the total time. `options` must outlive the
    /// run.
    LayeredRun(const LayeredRunOptions& options, std::vector<std::filesystem::path> inputs,
               Reporter& reporter);

    /// Checks the names of the output files, and sets the number of threads. Throws Error (kUsage)
    /// like checkOutput() and checkReport().
    void checkFiles() const;

    /// Calls `open_input(LayeredReadOptions)` with the reading options for this output, and returns
    /// the result.
    template <class OpenInput>
    auto open(OpenInput&& open_input) {
        return timed(result.milliseconds, "load",
                     [&] { return open_input(readingFor(options_.reading, {{output.path}})); });
    }
    /// Opens the only input, restricted to the chosen objects. Sets `plan` to the input's plan.
    std::unique_ptr<LayeredInput> openInput(const ObjectOptions& objects);

    /// Iterates over the bands of `plan`, like forEachBand() in layered_bands.h.
    template <class Read, class Take>
    void forEachBand(const Stage& stage, int rows, Read&& read, Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(plan.view.crop, rows, result.milliseconds, progress, read, take);
    }
    /// Iterates over the bands of an input. Keeps only the nearest `max_layers` layers; 0 = all.
    template <class Take>
    void forEachBand(const Stage& stage, LayeredInput& input, std::uint32_t max_layers,
                     Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(input, max_layers, result.milliseconds, progress, take);
    }

    /// Returns the output options, with the input's provenance and this version of peeler.
    OutputOptions outputOptions(Provenance provenance) const;
    /// Writes a picture with `plan` to a sink. `fill()` writes the bands.
    template <class Fill>
    void write(Sink& sink, Fill&& fill) {
        sink.begin(plan);
        fill();
        sink.finish();
        add(result.milliseconds, sink.times());
    }

    /// Stops measuring the total time and reports the picture. Throws Error (kOutput) if a file is
    /// missing.
    void report(const OutputOptions& written, const Provenance& provenance);

    OutputRequest output;  ///< the request, adjusted by the verb
    Plan plan;             ///< of the output
    PictureResult result;

  private:
    const LayeredRunOptions& options_;
    Reporter& reporter_;
    std::optional<StageTimer> total_;
};

}  // namespace peeler::cmd
