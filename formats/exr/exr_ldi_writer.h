// SPDX-License-Identifier: Apache-2.0
// Layered depth images: one part of an OpenEXR file for each layer.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/image/sink.h"
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_layout.h"

namespace peeler {

struct ExrLdiOptions {
    bool composite = true;         ///< begin with a part that shows all layers composited
    int level = kDefaultZipLevel;  ///< of libdeflate, 1–12
    bool cryptomatte = false;      ///< in the part composite; needs the channels id.*
    std::string layout = {};       ///< a name in the table of layouts, "" = plain
    Imf::Compression compression = Imf::ZIP_COMPRESSION;  ///< or ZIPS, RLE or none
};

/// Writes part `composite` (R,G,B,A as `Plan::color_type`, Z of the first fragment; compositeOver()
/// of the stored colours on nothing) and parts `layer_000`, `layer_001`, … front to back, each
/// cropped to its layer's data window: R,G,B,A, Z and the extra channels of the bands. A picture
/// without any fragment has the part `composite` alone, whatever the options say: a file must have
/// a part. `peeler:layout` names the layout; in the layout "per-file" the composite's file is
/// needed, since it is the one that names the set. The same plan, provenance and pixels make the
/// same bytes, however cut into bands.
class ExrLdiWriter : public Sink {
  public:
    ExrLdiWriter(std::string path, Provenance provenance, ExrLdiOptions options = {});
    ~ExrLdiWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Throws Error (kInternal) if the bands had other fragments than the plan says.
    void finish() override;
    SinkMemory memory() const override { return writer_->memory(); }
    StageTimes times() const override { return times_; }

  private:
    std::vector<ExrPart> partsOf(const Plan& plan, const ExrLayout& layout) const;

    std::string path_;
    Provenance provenance_;
    ExrLdiOptions options_;
    std::uint64_t fragments_planned_ = 0;
    std::unique_ptr<ExrBandWriter> writer_;
    StageTimes times_;
};

}  // namespace peeler
