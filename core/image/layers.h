// SPDX-License-Identifier: Apache-2.0
// Layers of a picture: depth complexity, and selections of layers and objects.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/sink.h>

namespace peeler {

/// Depth complexity: statistics of the number of fragments per pixel, accumulated row by row.
class DepthComplexity {
  public:
    explicit DepthComplexity(const Window& crop);

    /// Adds the fragment counts of the pixels of row y, from left to right, beginning at `x`
    /// (display-window coordinates). Each pixel of the crop may be added only once.
    void addRow(int x, int y, std::span<const std::uint32_t> counts);

    /// Adds pixels without fragments.
    void addEmpty(std::uint64_t pixels) { histogram_[0] += pixels; }

    /// Adds the fragment counts of a band's pixels.
    void addBand(const LayeredImage& band);

    /// Adds the statistics of another object, which must have accumulated other rows of the same
    /// crop.
    void add(const DepthComplexity& rows);

    /// Returns one entry for each of the nearest `limit` layers (0 = all), front to back.
    std::vector<LayerPlan> layers(std::uint32_t limit = 0) const;
    std::uint64_t counted() const { return counted_; }
    /// Returns the number of pixels for each number of fragments, from 0 to the maximum per pixel.
    const std::vector<std::uint64_t>& histogram() const { return histogram_; }
    /// Returns the number of fragments in row y, without the layer limit.
    std::uint64_t rowFragments(int y) const {
        return row_fragments_[static_cast<std::size_t>(y - crop_.y0)];
    }
    /// Returns the maximum number of fragments in any `rows` consecutive rows.
    std::uint64_t mostFragments(int rows) const;

  private:
    Window crop_;
    std::vector<Window> windows_;           // window of each layer
    std::vector<std::uint64_t> histogram_;  // number of pixels for each number of layers
    std::vector<std::uint64_t> row_fragments_;
    std::uint64_t counted_ = 0;
};

/// A selection of layers. A layer is selected if it is among the nearest `nearest` (0 = all) and in
/// `listed` (empty = all).
struct LayerSelection {
    std::uint32_t nearest = 0;
    /// Whether each layer is listed; layers beyond the end of the vector are not listed.
    std::vector<bool> listed{};

    bool all() const { return nearest == 0 && listed.empty(); }
    bool holds(std::size_t layer) const {
        return (nearest == 0 || layer < nearest) &&
               (listed.empty() || (layer < listed.size() && listed[layer]));
    }
};

/// Removes the fragments of unselected layers, in place and from every array of `image`. Fragments
/// behind a removed fragment move forward in their pixel's list.
void keepLayers(LayeredImage& image, const LayerSelection& selection);

/// A set of ids: the ids in `listed` or, if `others`, all ids that are not in `listed`.
struct IdSet {
    std::vector<std::uint32_t> listed{};  ///< ids in ascending order
    bool others = true;

    bool all() const { return others && listed.empty(); }
    bool holds(std::uint32_t id) const;
};

/// A selection of fragments by their channels id.object and id.material. A fragment is selected if
/// both ids are in their sets.
struct ObjectSelection {
    IdSet objects{}, materials{};
};

/// Returns a mark for each fragment: 1 if selected, 0 if not. If a channel is missing, its ids are
/// 0.
std::vector<char> markObjects(const LayeredImage& image, const ObjectSelection& selection);

/// Removes the fragments with mark 0 in the same way as keepLayers().
void keepMarked(LayeredImage& image, const std::vector<char>& marked);

/// Removes unselected fragments in the same way as keepLayers().
void keepObjects(LayeredImage& image, const ObjectSelection& selection);

/// Extracts one layer as an image with at most one fragment per pixel. Overwrites `out` and reuses
/// its storage.
void singleLayer(const LayeredImage& image, std::uint32_t layer, LayeredImage& out);

/// Appends an array "layer" (uint) with each fragment's index in its pixel's list.
void addLayerIndices(LayeredImage& image);

}  // namespace peeler
