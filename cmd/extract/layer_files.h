// SPDX-License-Identifier: Apache-2.0
// Layers as files, one per layer.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include <peeler/sink.h>
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// A writer of selected layers. An .exr is a layered file that holds one layer with all channels,
/// cropped to the layer's pixels. A .png, .jpg or .tif covers the picture's crop. Open files hold
/// rows in memory, so their number is limited; for more layers, the picture is read several times.
class LayerFiles {
  public:
    /// `output.path` is a name that may contain a pattern for the layer's number. Throws Error
    /// (kUsage) if two layers would share a name; otherwise throws like checkOutput().
    LayerFiles(const OutputRequest& output, const Provenance& provenance,
               std::vector<std::size_t> layers, const std::filesystem::path& input);

    /// Whether begin() needs the number of fragments in each layer.
    static bool needCounts(const OutputRequest& output);

    /// Whether begin() has not yet opened the files of all layers.
    bool left() const { return next_ < layers_.size(); }
    /// Opens the files of the next layers, as many as may be open at a time. `whole` is the plan of
    /// the picture, with LayerPlan::pixels if counts are needed. Throws Error (kOutput) if a file
    /// cannot be opened.
    void begin(const Plan& whole);
    /// Consumes a band that contains all layers, like Sink::write().
    void write(const LayeredImage& band);
    /// Finishes the open files and adds their times to `times`. Throws Error (kOutput) if writing
    /// fails.
    void finish(StageTimes& times);

    SizeForecast forecast(const Plan& whole, std::size_t layer) const;

    /// Returns the maximum memory of all files that are open at the same time, without the band.
    /// The `pixel_bytes` of the result is per pixel of a band. A band has `rows` rows and takes
    /// `fragment_bytes` bytes per fragment.
    SinkMemory memory(const Plan& whole, int rows, std::uint64_t fragment_bytes) const;

    std::filesystem::path path(std::size_t layer) const;
    const std::vector<std::size_t>& layers() const { return layers_; }

  private:
    static Plan planOf(const Plan& whole, std::size_t layer);

    OutputRequest output_;
    Provenance provenance_;
    std::vector<std::size_t> layers_;
    std::size_t next_ = 0;  ///< index into layers_ of the next file to open
    std::vector<std::pair<std::size_t, std::unique_ptr<Sink>>> open_;
    LayeredImage layer_;
};

}  // namespace peeler::cmd
