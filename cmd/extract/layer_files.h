// SPDX-License-Identifier: Apache-2.0
// Layers as files of their own.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "cmd/options/output_options.h"
#include "core/image/sink.h"

namespace peeler::cmd {

/// Writes chosen layers of a picture: an .exr is a layered file of one layer with all its channels,
/// cropped to the layer; a .png, .jpg or .tif shows the crop of the picture. Each open file keeps
/// rows in memory, so many layers take several readings of the picture.
class LayerFiles {
  public:
    /// `flags.path` is one name, or has a token for the layer's number. Throws Error (kUsage) if
    /// two layers would have one name, and whatever checkOutput() does.
    LayerFiles(const OutputFlags& flags, const Provenance& provenance,
               std::vector<std::size_t> layers, const std::filesystem::path& input);

    /// Whether write() has to be told how many fragments each layer has.
    static bool needCounts(const OutputFlags& flags);

    /// Whether begin() has layers left to open.
    bool left() const { return next_ < layers_.size(); }
    /// Opens the next files. `whole` is the plan of the picture, LayerPlan::pixels included if
    /// counts are needed.
    void begin(const Plan& whole);
    /// Takes the bands of all layers, as a Sink does.
    void write(const LayeredImage& band);
    void finish(StageTimes& times);

    std::filesystem::path path(std::size_t layer) const;
    const std::vector<std::size_t>& layers() const { return layers_; }

  private:
    OutputFlags flags_;
    Provenance provenance_;
    std::vector<std::size_t> layers_;
    std::size_t next_ = 0;  ///< of layers_
    std::vector<std::pair<std::size_t, std::unique_ptr<Sink>>> open_;
    LayeredImage layer_;
};

}  // namespace peeler::cmd
