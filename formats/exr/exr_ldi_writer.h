// SPDX-License-Identifier: Apache-2.0
// Layered depth images, one part of an OpenEXR file for each layer; and their composite alone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/image/sink.h"
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/output_options.h"

namespace peeler {

/// What both share: parts that bands are streamed into.
class ExrPartsSink : public Sink {
  public:
    ~ExrPartsSink() override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory() const override { return writer_->memory(); }
    StageTimes times() const override { return times_; }

  protected:
    ExrPartsSink(std::string path, OutputOptions options);

    std::string path_;
    OutputOptions options_;
    std::unique_ptr<ExrBandWriter> writer_;  ///< from begin() to finish()

  private:
    StageTimes times_;
};

/// Writes part `composite` (R,G,B,A as `Plan::color_type`, Z of the first fragment; compositeOver()
/// of the stored colours on nothing) and parts `layer_000`, `layer_001`, … front to back, each
/// cropped to its layer's data window: R,G,B,A, Z and the extra channels of the bands. A picture
/// without any fragment has the part `composite` alone, whatever the options say: a file must have
/// a part. `peeler:layout` names the layout; in the layout "per-file" the composite's file is
/// needed, since it is the one that names the set. The same plan, provenance and pixels make the
/// same bytes, however cut into bands.
class ExrLdiWriter : public ExrPartsSink {
  public:
    /// Throws Error (kUsage) if there is no such compression.
    explicit ExrLdiWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    /// Throws Error (kInternal) if the bands had other fragments than the plan says.
    void finish() override;

  private:
    std::vector<ExrPart> partsOf(const Plan& plan, const ExrLayout& layout) const;

    std::uint64_t fragments_planned_ = 0;
};

/// Writes a single-part file: R,G,B,A as `Plan::color_type`, Z (float, +inf where nothing is) and
/// the other channels of the first fragment; dataWindow = crop, with the attributes of a layered
/// file but `peeler:layer`. Compressed ZIP.
class ExrCompositeWriter : public ExrPartsSink {
  public:
    explicit ExrCompositeWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
};

}  // namespace peeler
