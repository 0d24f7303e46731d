// SPDX-License-Identifier: Apache-2.0
// The layers of a picture: how many there are and where, and some of them without the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/sink.h>

namespace peeler {

/// What follows from the number of fragments of every pixel, which is counted up row by row.
class DepthComplexity {
  public:
    explicit DepthComplexity(const Window& crop);

    /// The counts of pixels of row y, left to right from `x` (display-window coordinates). Every
    /// pixel of the crop at most once.
    void addRow(int x, int y, std::span<const std::uint32_t> counts);

    /// The counts of the pixels of a band.
    void addBand(const LayeredImage& band);

    /// What was counted of some of the rows.
    void add(const DepthComplexity& rows);

    /// One entry a layer, front to back; the nearest `limit` of them (0 = all).
    std::vector<LayerPlan> layers(std::uint32_t limit = 0) const;
    std::uint64_t counted() const { return counted_; }
    /// Pixels by their number of fragments, from 0 up to the most that a pixel has.
    const std::vector<std::uint64_t>& histogram() const { return histogram_; }
    /// Fragments counted in row y, without the layer limit.
    std::uint64_t rowFragments(int y) const {
        return row_fragments_[static_cast<std::size_t>(y - crop_.y0)];
    }
    /// The most fragments that so many consecutive rows hold together.
    std::uint64_t mostFragments(int rows) const;

  private:
    Window crop_;
    std::vector<Window> windows_;           // by layer
    std::vector<std::uint64_t> histogram_;  // pixels by their number of layers
    std::vector<std::uint64_t> row_fragments_;
    std::uint64_t counted_ = 0;
};

/// Which layers count: any of the nearest `nearest` ones (0 = all) that `listed` holds (empty =
/// all).
struct LayerSelection {
    std::uint32_t nearest = 0;
    std::vector<bool> listed{};  ///< by layer; those beyond its end are not in it

    bool all() const { return nearest == 0 && listed.empty(); }
    bool holds(std::size_t layer) const {
        return (nearest == 0 || layer < nearest) &&
               (listed.empty() || (layer < listed.size() && listed[layer]));
    }
};

/// Forgets the fragments of all other layers, in place; what is kept moves up in its pixel's list.
/// Every array of `image` follows.
void keepLayers(LayeredImage& image, const LayerSelection& selection);

/// Ids that count: those that are listed, or all others.
struct IdSet {
    std::vector<std::uint32_t> listed{};  ///< ascending
    bool others = true;

    bool all() const { return others && listed.empty(); }
    bool holds(std::uint32_t id) const;
};

/// Which fragments count by what they are of: those whose channels id.object and id.material both
/// hold ids that do.
struct ObjectSelection {
    IdSet objects{}, materials{};
};

/// Forgets all other fragments, like keepLayers(). Where a channel is missing every id is 0.
void keepObjects(LayeredImage& image, const ObjectSelection& selection);

/// One layer as an image of at most one fragment a pixel. `out` is overwritten; its storage is
/// reused.
void singleLayer(const LayeredImage& image, std::uint32_t layer, LayeredImage& out);

/// Appends an array "layer" (uint): the index of each fragment in its pixel's list.
void addLayerIndices(LayeredImage& image);

}  // namespace peeler
