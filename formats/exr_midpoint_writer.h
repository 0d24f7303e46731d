// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR images of the depth between the two nearest surfaces: midpoint shadow maps.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/sink.h"
#include "formats/atomic_file.h"
#include "formats/exr_chunks.h"

namespace peeler {

/// Writes a single-part file with one channel, Z (float): camera Z of the midpoint as
/// core/midpoint.h has it, +inf where a pixel has no second surface. dataWindow = crop, with the
/// attributes of a layered file but `peeler:layer`. What counts as a surface is the capture's
/// choice (CaptureSettings::opaque_only).
class ExrMidpointWriter : public Sink {
  public:
    ExrMidpointWriter(std::string path, Provenance provenance);
    ~ExrMidpointWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(const LayeredImage& band) override;
    /// Throws Error (kInternal) if rows are missing.
    void finish() override;
    SinkMemory memory() const override;
    StageTimes times() const override { return times_; }

  private:
    void writeChunks(bool last);

    std::string path_;
    Provenance provenance_;
    Plan plan_;
    std::unique_ptr<AtomicFile> file_;
    std::unique_ptr<ExrFile> exr_;
    ExrChunkPacker packer_;
    std::vector<std::byte> packed_;
    std::vector<float> rows_;  ///< of chunks that are not complete yet
    int next_chunk_ = 0;
    StageTimes times_;
};

}  // namespace peeler
