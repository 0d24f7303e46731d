// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/supersampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/parallel.h"
#include "core/image/composite.h"

namespace peeler {
namespace {

using MergedColor = std::array<double, kTintedComponents>;

double radicalInverse(unsigned index) {
    double value = 0, digit = 0.5;
    for (; index; index /= 2, digit /= 2)
        value += digit * (index % 2);
    return value;
}

/// One fragment of one sample of the current pixel.
struct Entry {
    float z;
    int sample;
    std::uint32_t fragment;  // index in its sample's image
    std::uint32_t surface;
};

/// Fragments to merge into one, at most one per sample.
struct Group {
    std::uint32_t surface;
    std::size_t nearest;  // index of the nearest member in the pixel's entries
    // For each sample: the index, in the pixel's entries, of the group's member from this sample;
    // −1 if the group has no member from it.
    std::vector<int> members;
};

struct MergedRow {
    std::vector<std::uint32_t> counts;  // number of merged fragments in each pixel
    std::vector<float> z;
    std::vector<MergedColor> colors;
    std::vector<std::pair<int, std::uint32_t>> nearest;  // sample, and the fragment's index in it
};

/// Merges the pixels of a row one after another, with the same buffers.
class RowMerger {
  public:
    RowMerger(std::span<const LayeredImage> samples, const SurfaceOf& surface_of)
        : samples_(samples), surface_of_(surface_of), last_group_(samples.size()) {}

    void merge(std::size_t pixel, MergedRow& row) {
        collect(pixel);
        group();
        row.counts.push_back(static_cast<std::uint32_t>(groups_.size()));
        composite(row);
    }

  private:
    void collect(std::size_t pixel);
    void group();
    bool fits(const Group& group, const Entry& entry) const;
    void composite(MergedRow& row) const;

    std::span<const LayeredImage> samples_;
    const SurfaceOf& surface_of_;
    std::vector<Entry> entries_;  // sorted by Z, then by sample and fragment
    std::vector<Group> groups_;
    std::vector<int> last_group_;  // latest group of each sample
};

void RowMerger::collect(std::size_t pixel) {
    entries_.clear();
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        const LayeredImage& image = samples_[s];
        const auto primitives = image.extra.front().as<std::uint32_t>();
        for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f)
            entries_.push_back({image.z[f], static_cast<int>(s), f, surface_of_(primitives[f])});
    }
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
        if (a.z != b.z) return a.z < b.z;
        return a.sample != b.sample ? a.sample < b.sample : a.fragment < b.fragment;
    });
}

/// Whether an entry may join the group. It may not if it is nearer in Z to another fragment of a
/// member's surface and sample than to this member. Such a fragment exists only if a surface covers
/// the pixel more than once (front and back of a ball, folds).
bool RowMerger::fits(const Group& group, const Entry& entry) const {
    for (const int member : group.members) {
        if (member < 0) continue;
        const Entry& own = entries_[static_cast<std::size_t>(member)];
        for (std::size_t i = static_cast<std::size_t>(member) + 1; i < entries_.size(); ++i) {
            const Entry& next = entries_[i];
            if (next.sample != own.sample || next.surface != own.surface) continue;
            if (std::abs(next.z - entry.z) < std::abs(own.z - entry.z)) return false;
            break;
        }
    }
    return true;
}

void RowMerger::group() {
    groups_.clear();
    std::fill(last_group_.begin(), last_group_.end(), -1);
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        const Entry& entry = entries_[i];
        int& last = last_group_[static_cast<std::size_t>(entry.sample)];
        // Searches only the groups behind the group of the sample's previous fragment, so that the
        // fragments of every sample keep their order.
        int found = static_cast<int>(groups_.size()) - 1;
        while (found > last && groups_[static_cast<std::size_t>(found)].surface != entry.surface)
            --found;
        if (found <= last || !fits(groups_[static_cast<std::size_t>(found)], entry)) {
            found = static_cast<int>(groups_.size());
            groups_.push_back({entry.surface, i, std::vector<int>(samples_.size(), -1)});
        }
        groups_[static_cast<std::size_t>(found)].members[static_cast<std::size_t>(entry.sample)] =
            static_cast<int>(i);
        last = found;
    }
}

void RowMerger::composite(MergedRow& row) const {
    constexpr double kNothing = 1e-9;
    using Through = std::array<double, 3>;  // transmittance per channel
    std::vector<Through> through(samples_.size(), {1, 1, 1});
    const auto samples = static_cast<double>(samples_.size());
    for (const Group& group : groups_) {
        Through all_through{};
        for (const Through& t : through)
            for (std::size_t c = 0; c < 3; ++c)
                all_through[c] += t[c];
        MergedColor seen{}, plain{};
        for (std::size_t s = 0; s < samples_.size(); ++s) {
            if (group.members[s] < 0) continue;
            const Entry& entry = entries_[static_cast<std::size_t>(group.members[s])];
            const TintedColor color = tintedColorOf(samples_[s], entry.fragment);
            for (std::size_t c = 0; c < 3; ++c) {
                for (const std::size_t i : {c, 4 + c}) {
                    seen[i] += through[s][c] * static_cast<double>(color[i]);
                    plain[i] += static_cast<double>(color[i]);
                }
                through[s][c] *= 1 - static_cast<double>(color[4 + c]);
            }
        }
        MergedColor merged{};
        for (std::size_t c = 0; c < 3; ++c) {
            const bool hidden = all_through[c] < kNothing;
            for (const std::size_t i : {c, 4 + c})
                merged[i] = hidden ? plain[i] / samples : seen[i] / all_through[c];
        }
        merged[3] = meanOpacity(merged[4], merged[5], merged[6]);
        const Entry& nearest = entries_[group.nearest];
        row.z.push_back(nearest.z);
        row.nearest.emplace_back(nearest.sample, nearest.fragment);
        row.colors.push_back(merged);
    }
}

TintedColor floatsOf(const MergedColor& color) {
    TintedColor result;
    for (std::size_t c = 0; c < result.size(); ++c)
        result[c] = static_cast<float>(color[c]);
    return result;
}

}  // namespace

std::vector<glm::dvec2> samplePositions(int samples) {
    std::vector<glm::dvec2> positions;
    const double step = 1.0 / samples;
    for (int i = 0; i < samples; ++i)
        positions.emplace_back((i + 0.5) * step,
                               radicalInverse(static_cast<unsigned>(i)) + 0.5 * step);
    // Exchanging the rows in pairs gives the positions of multisampling (Direct3D 11.3
    // specification, 19.2.4 "Standard Multisample Patterns"), upside down as in a GL picture.
    if (samples == 4) {
        std::swap(positions[0].y, positions[2].y);
        std::swap(positions[1].y, positions[3].y);
    }
    return positions;
}

void beginMean(const Window& window, CompositeImage& mean, bool with_opacity) {
    mean.window = window;
    mean.rgba.assign(window.pixels(), {});
    mean.opacity.assign(with_opacity ? window.pixels() : 0, {});
    mean.z.assign(window.pixels(), std::numeric_limits<float>::infinity());
}

void addToMean(const CompositeImage& sample, int samples, CompositeImage& mean) {
    const auto width = static_cast<std::size_t>(sample.window.width());
    const float weight = 1.0F / static_cast<float>(samples);
    parallelFor(static_cast<std::size_t>(sample.window.height()), [&](std::size_t row) {
        const auto y = static_cast<std::size_t>(sample.window.y0 - mean.window.y0) + row;
        std::size_t to = y * static_cast<std::size_t>(mean.window.width()) +
                         static_cast<std::size_t>(sample.window.x0 - mean.window.x0);
        for (std::size_t p = row * width; p < (row + 1) * width; ++p, ++to) {
            for (std::size_t c = 0; c < 4; ++c)
                mean.rgba[to][c] += weight * sample.rgba[p][c];
            for (std::size_t c = 0; c < 3 && sample.tinted(); ++c)
                mean.opacity[to][c] += weight * sample.opacity[p][c];
            mean.z[to] = std::min(mean.z[to], sample.z[p]);
        }
    });
}

void mergeSamples(std::span<const LayeredImage> samples, const SurfaceOf& surface_of,
                  PixelType color_type, LayeredImage& out) {
    const Window& window = samples.front().window;
    const auto width = static_cast<std::size_t>(window.width());
    const auto height = static_cast<std::size_t>(window.height());
    std::vector<MergedRow> rows(height);
    parallelFor(height, [&](std::size_t y) {
        RowMerger merger(samples, surface_of);
        for (std::size_t x = 0; x < width; ++x)
            merger.merge(y * width + x, rows[y]);
    });

    out.window = window;
    out.color = {samples.front().color.channels, color_type, {}};
    out.extra.clear();
    out.z.clear();
    out.offsets.assign(1, 0);
    for (const MergedRow& row : rows) {
        for (const std::uint32_t count : row.counts)
            out.offsets.push_back(out.offsets.back() + count);
        out.z.insert(out.z.end(), row.z.begin(), row.z.end());
    }
    out.color.data.resize(out.z.size() * out.color.stride());
    std::size_t fragment = 0;
    for (const MergedRow& row : rows) {
        for (const MergedColor& color : row.colors)
            storeColor(floatsOf(color), out.color, fragment++);
    }
    for (std::size_t i = 1; i < samples.front().extra.size(); ++i) {
        const FragmentArray& like = samples.front().extra[i];
        const std::size_t stride = like.stride();
        FragmentArray& array = out.extra.emplace_back(FragmentArray{like.channels, like.type, {}});
        array.data.reserve(out.z.size() * stride);
        for (const MergedRow& row : rows) {
            for (const auto& [sample, from] : row.nearest) {
                const auto* data = samples[static_cast<std::size_t>(sample)].extra[i].data.data();
                array.data.insert(array.data.end(), data + from * stride,
                                  data + (from + 1) * stride);
            }
        }
    }
}

}  // namespace peeler
