// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_buffers.h"

#include <algorithm>

#include "shaders/interface.glsl"

namespace peeler {

void BandBuffers::bindClip() const {
    if (clip_first_) clip_first_.bindStorage(PEELER_CLIP_FIRST);
    if (clip_depths_) clip_depths_.bindStorage(PEELER_CLIP_DEPTHS);
}

void BandBuffers::bindForLayers() const {
    if (slots_) slots_.bindStorage(PEELER_SLOTS);
    if (fragments_) fragments_.bindStorage(PEELER_FRAGMENTS);
    if (channels_) channels_.bindStorage(PEELER_CHANNELS);
    bindClip();
}

void BandBuffers::bindForComposite() const {
    slots_.bindStorage(PEELER_SLOTS);
    depths_.bindStorage(PEELER_DEPTHS);
    stamps_.bindStorage(PEELER_STAMPS);
    colors_.bindStorage(PEELER_COLORS);
    counts_.bindStorage(PEELER_COUNTS);
    bindClip();
}

void BandBuffers::reserveClip(std::span<const std::uint32_t> first) {
    reserve(clip_first_, first.size_bytes());
    reserve(clip_depths_, first.back() * sizeof(float));
    const auto mapping = clip_first_.overwrite(first.size_bytes());
    std::copy(first.begin(), first.end(), mapping.as<std::uint32_t>());
}

void BandBuffers::clearForComposite(std::span<const std::uint32_t> counts) {
    const std::size_t words = counts.size() * sizeof(std::uint32_t);
    reserveSlots(counts.size());
    reserve(depths_, words);
    reserve(stamps_, 2 * words);
    reserve(colors_, 4 * words);
    reserve(counts_, words);
    slots_.clearToZero(words);
    depths_.clearToZero(words);
    stamps_.clearToZero(2 * words);
    const auto mapping = counts_.overwrite(words);
    std::copy(counts.begin(), counts.end(), mapping.as<std::uint32_t>());
}

}  // namespace peeler
