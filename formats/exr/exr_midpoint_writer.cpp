// SPDX-License-Identifier: Apache-2.0
// One part, one channel.
#include "formats/exr/exr_midpoint_writer.h"

#include <span>
#include <utility>

#include "core/image/statistics.h"

namespace peeler {

ExrMidpointWriter::ExrMidpointWriter(std::string path, Provenance provenance)
    : path_(std::move(path)), provenance_(std::move(provenance)) {}

ExrMidpointWriter::~ExrMidpointWriter() = default;

void ExrMidpointWriter::begin(const Plan& plan) {
    projection_ = plan.view.projection;
    plane_ = std::make_unique<ExrPlaneWriter>(path_, plan, provenance_, "midpoint", "Z",
                                              PixelType::kFloat);
}

void ExrMidpointWriter::write(LayeredImage&& band) {
    {
        const StageTimer timer(times_, "composite");
        midpoints_.resize(band.window.pixels());
        midpoints(band, projection_, midpoints_);
    }
    plane_->append(std::as_bytes(std::span(midpoints_)));
}

void ExrMidpointWriter::finish() {
    plane_->finish();
}

SinkMemory ExrMidpointWriter::memory() const {
    // The midpoints of a band are what other sinks composite into.
    return {0, plane_->memory()};
}

StageTimes ExrMidpointWriter::times() const {
    StageTimes all = times_;
    if (plane_) add(all, plane_->times());
    return all;
}

}  // namespace peeler
