// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/layered_run.h"

#include <utility>

#include "cmd/machine/resources.h"
#include "cmd/options/empty_picture.h"
#include "cmd/options/output_checks.h"

namespace peeler::cmd {

LayeredRun::LayeredRun(const LayeredRunOptions& options, std::vector<std::filesystem::path> inputs,
                       Reporter& reporter)
    : output(options.output), options_(options), reporter_(reporter) {
    result.inputs = std::move(inputs);
    total_.emplace(result.milliseconds, "total");
    options_.report.applyTo(reporter_);
}

void LayeredRun::checkFiles() const {
    checkOutput(output, result.inputs);
    std::vector<std::filesystem::path> files = result.inputs;
    files.push_back(output.path);
    checkReport(options_.report, files);
    setThreads(options_.threads);
}

std::unique_ptr<LayeredInput> LayeredRun::openInput(const ObjectOptions& objects) {
    auto input = open([&](const LayeredReadOptions& reading) {
        return openChosen(result.inputs.front().string(), reading, objects, reporter_);
    });
    plan = input->info().plan;
    if (plan.layers.empty()) {
        reportEmpty(output.path,
                    objects.any() ? "--include, --exclude and --material leave no fragments"
                                  : "the file has no fragments",
                    options_.reading.strict, reporter_);
    }
    return input;
}

OutputOptions LayeredRun::outputOptions(Provenance provenance) const {
    provenance.version = PEELER_VERSION;
    OutputOptions written = output.from(provenance);
    written.automatic_exposure = output.leavesExposureOpen();
    return written;
}

void LayeredRun::report(const OutputOptions& written, const Provenance& provenance) {
    total_.reset();
    result.output = output.path;
    describePicture(plan, provenance, result);
    describeFiles(output, result, reporter_);
    describeDisplay(written, written.automatic_exposure, result);
    noteDisplay(result, reporter_);
    reportResult(options_.report, result, reporter_);
}

}  // namespace peeler::cmd
