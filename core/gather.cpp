// SPDX-License-Identifier: Apache-2.0
#include "core/gather.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "core/parallel.h"

namespace peeler {
namespace {

struct Entry {
    float depth;
    std::uint32_t primitive;
    std::uint32_t index;
};

bool precedes(const Entry& a, const Entry& b) {
    return a.depth > b.depth || (a.depth == b.depth && a.primitive < b.primitive);
}

/// Insertion sort: lists are short, and often already in order.
void sortShort(Entry* entries, std::size_t count) {
    for (std::size_t i = 1; i < count; ++i) {
        const Entry entry = entries[i];
        std::size_t at = i;
        for (; at > 0 && precedes(entry, entries[at - 1]); --at)
            entries[at] = entries[at - 1];
        entries[at] = entry;
    }
}

constexpr std::size_t kShort = 48;

/// resize() for contents that will be overwritten: never holds the old and the new storage at once.
template <class T>
void resizeAnew(std::vector<T>& values, std::size_t size) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(size);
    }
    values.resize(size);
}

template <class Color>
void gatherRow(const CapturedFragments& captured, const Projection& projection,
               std::size_t first_pixel, std::size_t pixels, LayeredImage& out,
               std::uint32_t* sources, std::vector<Entry>& entries) {
    const auto* colors = static_cast<const Color*>(captured.color);
    auto* out_colors = reinterpret_cast<Color*>(out.color.data.data());
    for (std::size_t p = first_pixel; p < first_pixel + pixels; ++p) {
        const std::uint32_t begin = captured.first[p], end = captured.first[p + 1];
        entries.clear();
        for (std::uint32_t i = begin; i < end; ++i)
            entries.push_back({captured.depth[i], captured.primitive[i], i});
        if (entries.size() <= kShort)
            sortShort(entries.data(), entries.size());
        else
            std::sort(entries.begin(), entries.end(), precedes);
        const std::uint32_t to = out.offsets[p], kept = out.offsets[p + 1] - to;
        for (std::uint32_t k = 0; k < kept; ++k) {
            const double depth = static_cast<double>(entries[k].depth);
            out.z[to + k] = static_cast<float>(projection.linearZ(depth));
            if (colors) out_colors[to + k] = colors[entries[k].index];
            if (sources) sources[to + k] = entries[k].index;
        }
    }
}

struct HalfColor {
    std::uint64_t bits;
};
struct FloatColor {
    std::uint64_t bits[2];
};

}  // namespace

void gather(const CapturedFragments& captured, const Projection& projection,
            std::uint32_t max_layers, LayeredImage& out, std::vector<std::uint32_t>* sources) {
    const std::size_t pixels = out.window.pixels();
    resizeAnew(out.offsets, pixels + 1);
    out.offsets[0] = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
        std::uint32_t kept = captured.first[p + 1] - captured.first[p];
        if (max_layers) kept = std::min(kept, max_layers);
        out.offsets[p + 1] = out.offsets[p] + kept;
    }
    const std::size_t fragments = out.offsets[pixels];
    resizeAnew(out.z, fragments);
    resizeAnew(out.color.data, fragments * out.color.stride());
    if (sources) resizeAnew(*sources, fragments);
    std::uint32_t* const out_sources = sources ? sources->data() : nullptr;

    const auto width = static_cast<std::size_t>(out.window.width());
    const auto rows = static_cast<std::size_t>(out.window.height());
    parallelFor(rows, [&](std::size_t row) {
        thread_local std::vector<Entry> entries;
        if (out.color.stride() <= sizeof(HalfColor))
            gatherRow<HalfColor>(captured, projection, row * width, width, out, out_sources,
                                 entries);
        else
            gatherRow<FloatColor>(captured, projection, row * width, width, out, out_sources,
                                  entries);
    });
}

}  // namespace peeler
