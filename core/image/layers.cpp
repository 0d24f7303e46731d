// SPDX-License-Identifier: Apache-2.0
#include "core/image/layers.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace peeler {
namespace {

void moveFragments(FragmentArray& array, std::size_t from, std::size_t to, std::size_t count) {
    const std::size_t stride = array.stride();
    std::memmove(array.data.data() + to * stride, array.data.data() + from * stride,
                 count * stride);
}

void moveFragments(LayeredImage& image, std::size_t from, std::size_t to, std::size_t count) {
    if (from == to) return;
    std::memmove(image.z.data() + to, image.z.data() + from, count * sizeof(float));
    moveFragments(image.color, from, to, count);
    for (FragmentArray& array : image.extra)
        moveFragments(array, from, to, count);
}

/// Removes, in place, the fragments for which keep(layer, fragment) is false. Calls keep() once per
/// fragment, in order, before the fragment can be overwritten.
template <class Keep>
void keepFragments(LayeredImage& image, Keep&& keep) {
    std::uint32_t kept = 0;
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        const std::uint32_t first = image.offsets[pixel], count = image.count(pixel);
        // The offset of this pixel can be overwritten, because the loop reads only the offsets of
        // later pixels.
        image.offsets[pixel] = kept;
        for (std::uint32_t k = 0, end = 0; k < count; k = end + 1) {
            end = k;
            while (end < count && keep(end, std::size_t{first} + end))
                ++end;
            moveFragments(image, first + k, kept, end - k);
            kept += end - k;
        }
    }
    image.offsets.back() = kept;
    image.z.resize(kept);
    image.color.data.resize(kept * image.color.stride());
    for (FragmentArray& array : image.extra)
        array.data.resize(kept * array.stride());
}

void pickFragments(const FragmentArray& from, const std::vector<std::uint32_t>& fragments,
                   FragmentArray& to) {
    const std::size_t stride = from.stride();
    to.channels = from.channels;
    to.type = from.type;
    to.data.resize(fragments.size() * stride);
    for (std::size_t i = 0; i < fragments.size(); ++i) {
        std::memcpy(to.data.data() + i * stride, from.data.data() + fragments[i] * stride, stride);
    }
}

}  // namespace

DepthComplexity::DepthComplexity(const Window& crop)
    : crop_(crop), histogram_(1), row_fragments_(static_cast<std::size_t>(crop.height())) {}

void DepthComplexity::addRow(int x0, int y, std::span<const std::uint32_t> counts) {
    // Layer k's window grows to include the first and the last pixel of the row with more than k
    // fragments. These pixels are found by a scan from each end. In a scan, a pixel matters only
    // for layers above the highest count so far, so a scan takes linear time in pixels + layers.
    std::uint64_t total = 0;
    std::uint32_t seen = 0;
    for (std::size_t i = 0, end = 0; i < counts.size(); i = end) {
        const std::uint32_t layers = counts[i];
        while (end < counts.size() && counts[end] == layers)
            ++end;
        const std::uint64_t pixels = end - i;
        total += layers * pixels;
        if (layers >= histogram_.size()) histogram_.resize(layers + std::size_t{1});
        histogram_[layers] += pixels;
        if (layers > windows_.size()) windows_.resize(layers);
        const int x = x0 + static_cast<int>(i);
        for (; seen < layers; ++seen)
            windows_[seen] = unite(windows_[seen], {x, y, x + 1, y + 1});
    }
    std::uint32_t seen_from_right = 0;
    for (std::size_t i = counts.size(); i-- > 0 && seen_from_right < seen;) {
        const int x = x0 + static_cast<int>(i);
        for (; seen_from_right < counts[i]; ++seen_from_right)
            windows_[seen_from_right] = unite(windows_[seen_from_right], {x, y, x + 1, y + 1});
    }
    row_fragments_[static_cast<std::size_t>(y - crop_.y0)] += total;
    counted_ += total;
}

void DepthComplexity::addBand(const LayeredImage& band) {
    const auto width = static_cast<std::size_t>(band.window.width());
    std::vector<std::uint32_t> counts(width);
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        const std::size_t first = band.pixelIndex(band.window.x0, y);
        for (std::size_t x = 0; x < width; ++x)
            counts[x] = band.count(first + x);
        addRow(band.window.x0, y, counts);
    }
}

void DepthComplexity::add(const DepthComplexity& rows) {
    if (histogram_.size() < rows.histogram_.size()) histogram_.resize(rows.histogram_.size());
    for (std::size_t i = 0; i < rows.histogram_.size(); ++i)
        histogram_[i] += rows.histogram_[i];
    if (windows_.size() < rows.windows_.size()) windows_.resize(rows.windows_.size());
    for (std::size_t i = 0; i < rows.windows_.size(); ++i)
        windows_[i] = unite(windows_[i], rows.windows_[i]);
    const auto first = static_cast<std::size_t>(rows.crop_.y0 - crop_.y0);
    for (std::size_t y = 0; y < rows.row_fragments_.size(); ++y)
        row_fragments_[first + y] += rows.row_fragments_[y];
    counted_ += rows.counted_;
}

std::uint64_t DepthComplexity::mostFragments(int rows) const {
    const auto height = static_cast<std::size_t>(std::max(0, rows));
    std::uint64_t most = 0, sum = 0;
    for (std::size_t y = 0; y < row_fragments_.size() && height > 0; ++y) {
        sum += row_fragments_[y];
        if (y >= height) sum -= row_fragments_[y - height];
        most = std::max(most, sum);
    }
    return most;
}

std::vector<LayerPlan> DepthComplexity::layers(std::uint32_t limit) const {
    std::vector<LayerPlan> plans(windows_.size());
    std::uint64_t pixels = 0;
    for (std::size_t k = windows_.size(); k-- > 0;) {
        pixels += histogram_[k + 1];  // all pixels with more than k fragments
        plans[k] = {windows_[k], pixels};
    }
    if (limit != 0 && limit < plans.size()) plans.resize(limit);
    return plans;
}

bool IdSet::holds(std::uint32_t id) const {
    return std::binary_search(listed.begin(), listed.end(), id) != others;
}

void keepLayers(LayeredImage& image, const LayerSelection& selection) {
    if (selection.all()) return;
    keepFragments(image, [&](std::uint32_t layer, std::size_t) { return selection.holds(layer); });
}

std::vector<char> markObjects(const LayeredImage& image, const ObjectSelection& selection) {
    const FragmentChannel objects = findIds(image, "id.object");
    const FragmentChannel materials = findIds(image, "id.material");
    const auto idOf = [](const FragmentChannel& ids, std::size_t fragment) {
        return ids ? ids.id(fragment) : 0;
    };
    std::vector<char> marked(image.fragments());
    for (std::size_t i = 0; i < marked.size(); ++i)
        marked[i] = selection.objects.holds(idOf(objects, i)) &&
                    selection.materials.holds(idOf(materials, i));
    return marked;
}

void keepMarked(LayeredImage& image, const std::vector<char>& marked) {
    keepFragments(image,
                  [&](std::uint32_t, std::size_t fragment) { return marked[fragment] != 0; });
}

void keepObjects(LayeredImage& image, const ObjectSelection& selection) {
    if (selection.objects.all() && selection.materials.all()) return;
    keepMarked(image, markObjects(image, selection));
}

void singleLayer(const LayeredImage& image, std::uint32_t layer, LayeredImage& out) {
    const std::size_t pixels = image.window.pixels();
    std::vector<std::uint32_t> fragments;
    out.window = image.window;
    out.offsets.assign(pixels + 1, 0);
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        if (image.count(pixel) > layer) fragments.push_back(image.offsets[pixel] + layer);
        out.offsets[pixel + 1] = static_cast<std::uint32_t>(fragments.size());
    }
    out.z.resize(fragments.size());
    for (std::size_t i = 0; i < fragments.size(); ++i)
        out.z[i] = image.z[fragments[i]];
    pickFragments(image.color, fragments, out.color);
    out.extra.resize(image.extra.size());
    for (std::size_t i = 0; i < out.extra.size(); ++i)
        pickFragments(image.extra[i], fragments, out.extra[i]);
}

void addLayerIndices(LayeredImage& image) {
    FragmentArray indices{{"layer"}, PixelType::kUint, {}};
    indices.data.resize(image.fragments() * indices.stride());
    const auto values = indices.as<std::uint32_t>();
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        for (std::uint32_t k = 0; k < image.count(pixel); ++k)
            values[image.offsets[pixel] + k] = k;
    }
    image.extra.push_back(std::move(indices));
}

}  // namespace peeler
