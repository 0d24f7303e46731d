// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR images of the depth between the two nearest surfaces: midpoint shadow maps.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/image/sink.h"
#include "formats/exr/exr_plane_writer.h"

namespace peeler {

/// Writes a single-part file with one channel, Z (float): camera Z of the midpoint as
/// core/image/midpoint.h has it, +inf where a pixel has no second surface. dataWindow = crop, with
/// the attributes of a layered file but `peeler:layer`. What counts as a surface is the capture's
/// choice (CaptureSettings::opaque_only).
class ExrMidpointWriter : public Sink {
  public:
    ExrMidpointWriter(std::string path, Provenance provenance);
    ~ExrMidpointWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Throws Error (kInternal) if rows are missing.
    void finish() override;
    SinkMemory memory() const override;
    StageTimes times() const override;

  private:
    std::string path_;
    Provenance provenance_;
    Projection projection_;
    std::unique_ptr<ExrPlaneWriter> plane_;
    std::vector<float> midpoints_;  ///< of a band
    StageTimes times_;
};

}  // namespace peeler
