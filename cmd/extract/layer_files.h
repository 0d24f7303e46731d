// SPDX-License-Identifier: Apache-2.0
// Layers of a picture, each in a file of its own.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include <peeler/sink.h>
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Writes chosen layers of a picture: an .exr is a layered file of one layer with all its channels,
/// cropped to the layer; a .png, .jpg or .tif shows the crop of the picture. Each open file keeps
/// rows in memory, so many layers take several readings of the picture.
class LayerFiles {
  public:
    /// `output.path` is one name, or has a place for the layer's number. Throws Error (kUsage) if
    /// two layers would have one name, and like checkOutput().
    LayerFiles(const OutputRequest& output, const Provenance& provenance,
               std::vector<std::size_t> layers, const std::filesystem::path& input);

    /// Whether write() has to be told how many fragments each layer has.
    static bool needCounts(const OutputRequest& output);

    /// Whether begin() has layers left to open.
    bool left() const { return next_ < layers_.size(); }
    /// Opens the next files. `whole` is the plan of the picture, LayerPlan::pixels included if
    /// counts are needed. Throws Error (kOutput).
    void begin(const Plan& whole);
    /// Takes the bands of all layers, as a Sink does.
    void write(const LayeredImage& band);
    /// Ends the files that are open, and adds what they took to `times`. Throws Error (kOutput).
    void finish(StageTimes& times);

    /// How large the file of a layer will be.
    SizeForecast forecast(const Plan& whole, std::size_t layer) const;

    /// Most bytes that the files that are open at a time hold besides the bands that they take, and
    /// bytes of every pixel of such a band (`pixel_bytes`): bands of so many rows, whose fragments
    /// have `fragment_bytes`.
    SinkMemory memory(const Plan& whole, int rows, std::uint64_t fragment_bytes) const;

    std::filesystem::path path(std::size_t layer) const;
    const std::vector<std::size_t>& layers() const { return layers_; }

  private:
    static Plan planOf(const Plan& whole, std::size_t layer);

    OutputRequest output_;
    Provenance provenance_;
    std::vector<std::size_t> layers_;
    std::size_t next_ = 0;  ///< index into layers_ of the next one to open
    std::vector<std::pair<std::size_t, std::unique_ptr<Sink>>> open_;
    LayeredImage layer_;
};

}  // namespace peeler::cmd
