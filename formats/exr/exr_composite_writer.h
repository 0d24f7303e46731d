// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR images: all layers composited.
#pragma once

#include <memory>
#include <string>

#include "core/image/sink.h"
#include "formats/exr/exr_band_writer.h"

namespace peeler {

/// Writes a single-part file: R,G,B,A as `Plan::color_type`, Z (float, +inf where nothing is) of
/// the first fragment and, with ExrBandOptions::nearest_channels, its other channels; dataWindow =
/// crop, with the attributes of a layered file but `peeler:layer`.
class ExrCompositeWriter : public Sink {
  public:
    ExrCompositeWriter(std::string path, Provenance provenance, ExrBandOptions options = {});
    ~ExrCompositeWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory() const override { return writer_->memory(); }
    StageTimes times() const override { return times_; }

  private:
    std::string path_;
    Provenance provenance_;
    ExrBandOptions options_;
    std::unique_ptr<ExrBandWriter> writer_;
    StageTimes times_;
};

}  // namespace peeler
