// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR images of one number a pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/sink.h"

namespace peeler {

/// Streams rows into a single-part file with one channel. dataWindow = crop, with the attributes of
/// a layered file but `peeler:layer`.
class ExrPlaneWriter {
  public:
    /// Creates the hidden file; `type` is float or uint. Throws Error (kOutput).
    ExrPlaneWriter(const std::string& path, const Plan& plan, const Provenance& provenance,
                   const std::string& part, const std::string& channel, PixelType type);
    ~ExrPlaneWriter();

    /// The next rows of the crop, top to bottom, 4 bytes a pixel.
    void append(std::span<const std::byte> rows);
    /// Throws Error (kInternal) if rows are missing.
    void finish();

    std::uint64_t memory() const;  ///< bytes kept besides what append() gets
    const StageTimes& times() const { return times_; }

  private:
    void writeChunks(bool last);

    struct File;
    std::size_t row_bytes_;
    std::unique_ptr<File> file_;
    std::vector<std::byte> rows_;  ///< of chunks that are not complete yet
    int next_chunk_ = 0;
    StageTimes times_;
};

}  // namespace peeler
