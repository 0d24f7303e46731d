// SPDX-License-Identifier: Apache-2.0
// One run of a verb that makes one picture of layered files.
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

/// What every such verb declares, besides its inputs.
struct LayeredRunOptions {
    LayeredReadOptions reading{};
    int threads = 0;
    OutputRequest output{};
    ReportOptions report{};
};

/// The state of a run, and what all of these verbs do in each of its stages. A verb calls these in
/// their order: checkFiles(), open() or openInput(), forEachBand(), write(), report().
class LayeredRun {
  public:
    /// Applies the report's options; the total time begins. `options` must outlive the run.
    LayeredRun(const LayeredRunOptions& options, std::vector<std::filesystem::path> inputs,
               Reporter& reporter);

    /// Checks the names of the files that are written, and sets the threads. Throws Error (kUsage)
    /// like checkOutput() and checkReport().
    void checkFiles() const;

    /// Returns what `open_input(LayeredReadOptions)` does, for reading into the output.
    template <class OpenInput>
    auto open(OpenInput&& open_input) {
        return timed(result.milliseconds, "load",
                     [&] { return open_input(readingFor(options_.reading, {{output.path}})); });
    }
    /// Opens the one input, with the fragments of these objects alone. Its plan is `plan` then.
    std::unique_ptr<LayeredInput> openInput(const ObjectOptions& objects);

    /// Goes through `plan`, as forEachBand() of layered_bands.h does.
    template <class Read, class Take>
    void forEachBand(const Stage& stage, int rows, Read&& read, Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(plan.view.crop, rows, result.milliseconds, progress, read, take);
    }
    /// Goes through the nearest `max_layers` layers of an input, 0 = all.
    template <class Take>
    void forEachBand(const Stage& stage, LayeredInput& input, std::uint32_t max_layers,
                     Take&& take) {
        ProgressReport progress(reporter_, stage);
        cmd::forEachBand(input, max_layers, result.milliseconds, progress, take);
    }

    /// Options of the output, made of an input with this provenance by this version.
    OutputOptions outputOptions(Provenance provenance) const;
    /// Writes `plan` to a sink, into which `fill()` writes the bands.
    template <class Fill>
    void write(Sink& sink, Fill&& fill) {
        sink.begin(plan);
        fill();
        sink.finish();
        add(result.milliseconds, sink.times());
    }

    /// Ends the total time, and reports the picture. Throws Error (kOutput) if a file is gone.
    void report(const OutputOptions& written, const Provenance& provenance);

    OutputRequest output;  ///< as it was asked for, and what the verb chooses of it
    Plan plan;             ///< of the output
    PictureResult result;

  private:
    const LayeredRunOptions& options_;
    Reporter& reporter_;
    std::optional<StageTimer> total_;
};

}  // namespace peeler::cmd
