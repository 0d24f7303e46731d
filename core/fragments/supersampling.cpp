// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/supersampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>

#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "core/image/stored_colors.h"

namespace peeler {
namespace {

double radicalInverse(unsigned index) {
    double value = 0, digit = 0.5;
    for (; index; index /= 2, digit /= 2)
        value += digit * (index % 2);
    return value;
}

/// One fragment of one sample of the current pixel.
struct Entry {
    float z;
    std::uint32_t sample;
    std::uint32_t fragment;  // index in its sample's image
    std::uint32_t surface;
    // Z of the next fragment behind it, of its sample and surface; infinity if there is none.
    float next_z = 0;
};

struct MergedRow {
    std::vector<float> z;
    FragmentArray color;
    // The image and the index of each merged fragment's nearest member.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> nearest;
};

/// Merges the pixels of a row one after another, with the same buffers.
class RowMerger {
  public:
    RowMerger(std::span<const LayeredImage> samples, const SurfaceOf& surface_of)
        : samples_(samples),
          surface_of_(surface_of),
          begin_(samples.size() + 1),
          last_group_(samples.size()),
          through_(samples.size()) {}

    /// Returns the number of merged fragments.
    std::uint32_t merge(std::size_t pixel, MergedRow& row) {
        collect(pixel);
        if (!groupByLayer()) groupByDepth();
        if (samples_.front().tinted())
            composite<TintedColor>(row);
        else
            composite<std::array<float, 4>>(row);
        return static_cast<std::uint32_t>(groups_.size());
    }

  private:
    void collect(std::size_t pixel);
    bool groupByLayer();
    void groupByDepth();
    void sortEntries();
    /// Returns the entries of a group, by sample; kNoFragment where a sample has none.
    std::span<std::uint32_t> membersOf(std::size_t group) {
        return std::span(members_).subspan(group * samples_.size(), samples_.size());
    }
    bool fits(std::size_t group, const Entry& entry);
    template <class C>
    void composite(MergedRow& row);

    std::span<const LayeredImage> samples_;
    const SurfaceOf& surface_of_;
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> begin_;  // first entry of each sample, then the end
    // Groups are fragments that are merged into one, at most one per sample.
    std::vector<std::uint32_t> groups_;   // nearest entry of each group
    std::vector<std::uint32_t> members_;  // membersOf() each group
    std::vector<int> last_group_;         // latest group of each sample
    // Transmittance of each sample, for one or three opacities.
    std::vector<std::array<double, 4>> through_;
};

/// Sets the entries of a pixel: sample after sample, each from front to back.
void RowMerger::collect(std::size_t pixel) {
    entries_.clear();
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        const LayeredImage& image = samples_[s];
        const auto keys = image.extra.front().as<std::uint32_t>();
        begin_[s] = static_cast<std::uint32_t>(entries_.size());
        for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f)
            entries_.push_back(
                {image.z[f], static_cast<std::uint32_t>(s), f, surface_of_(keys[f])});
    }
    begin_.back() = static_cast<std::uint32_t>(entries_.size());
}

/// Groups the k-th fragments of all samples if groupByDepth() would do so. Most pixels are like
/// that: all samples see the same surfaces, one clearly behind the other. Returns whether the
/// pixel is one of them.
bool RowMerger::groupByLayer() {
    groups_.clear();
    members_.clear();
    const std::uint32_t layers = begin_[1];
    for (std::size_t s = 0; s < begin_.size(); ++s)
        if (begin_[s] != s * layers) return false;
    float last_least_z = 0, last_most_z = -std::numeric_limits<float>::infinity();
    for (std::uint32_t layer = 0; layer < layers; ++layer) {
        std::uint32_t nearest = layer;
        float most_z = entries_[layer].z;
        for (std::uint32_t i = layer; i < entries_.size(); i += layers) {
            if (entries_[i].surface != entries_[layer].surface) return false;
            if (entries_[i].z < entries_[nearest].z) nearest = i;
            most_z = std::max(most_z, entries_[i].z);
        }
        // The gap between two layers must be at least as wide as the layer in front. Otherwise, a
        // fragment may be nearer to the next fragment of its surface.
        const float gap = entries_[nearest].z - last_most_z;
        if (!(gap > 0) || gap < last_most_z - last_least_z) return false;
        last_least_z = entries_[nearest].z;
        last_most_z = most_z;
        groups_.push_back(nearest);
    }
    for (std::uint32_t layer = 0; layer < layers; ++layer)
        for (std::uint32_t i = layer; i < entries_.size(); i += layers)
            members_.push_back(i);
    return true;
}

/// Sets `next_z` of the entries, and sorts them by Z, then by sample.
void RowMerger::sortEntries() {
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        for (std::uint32_t i = begin_[s]; i < begin_[s + 1]; ++i) {
            const auto rest = std::span(entries_).subspan(i + 1, begin_[s + 1] - i - 1);
            const auto next = std::ranges::find(rest, entries_[i].surface, &Entry::surface);
            entries_[i].next_z =
                next == rest.end() ? std::numeric_limits<float>::infinity() : next->z;
        }
    }
    std::ranges::stable_sort(entries_, {}, &Entry::z);
}

/// Whether an entry may join the group. It may not if it is nearer in Z to another fragment of a
/// member's surface and sample than to this member. Such a fragment exists only if a surface covers
/// the pixel more than once (front and back of a ball, folds).
bool RowMerger::fits(std::size_t group, const Entry& entry) {
    return std::ranges::none_of(membersOf(group), [&](std::uint32_t member) {
        if (member == kNoFragment) return false;
        const Entry& own = entries_[member];
        return std::abs(own.next_z - entry.z) < std::abs(own.z - entry.z);
    });
}

void RowMerger::groupByDepth() {
    groups_.clear();
    members_.clear();
    sortEntries();
    std::fill(last_group_.begin(), last_group_.end(), -1);
    for (std::uint32_t i = 0; i < entries_.size(); ++i) {
        const Entry& entry = entries_[i];
        int& last = last_group_[entry.sample];
        // Searches only the groups behind the group of the sample's previous fragment, so that the
        // fragments of every sample keep their order.
        int found = static_cast<int>(groups_.size()) - 1;
        while (found > last &&
               entries_[groups_[static_cast<std::size_t>(found)]].surface != entry.surface)
            --found;
        if (found <= last || !fits(static_cast<std::size_t>(found), entry)) {
            found = static_cast<int>(groups_.size());
            groups_.push_back(i);
            members_.insert(members_.end(), samples_.size(), kNoFragment);
        }
        membersOf(static_cast<std::size_t>(found))[entry.sample] = i;
        last = found;
    }
}

/// `C`: the colours of the samples, plain or with coloured opacity.
template <class C>
void RowMerger::composite(MergedRow& row) {
    constexpr double kNothing = 1e-9;
    constexpr std::size_t kSize = std::tuple_size_v<C>, kOpacities = kSize == 4 ? 1 : 3;
    // Components are R, G, B, and A or A, AR, AG, AB. opacityOf() returns the index of the opacity
    // that applies to a component; componentOf() returns the component that is an opacity. The A of
    // coloured opacity is set last.
    constexpr auto opacityOf = [](std::size_t i) { return kOpacities == 1 ? 0 : i % 4; };
    constexpr auto componentOf = [](std::size_t opacity) { return opacity + kSize - kOpacities; };
    std::fill(through_.begin(), through_.end(), std::array<double, 4>{1, 1, 1, 1});
    const auto samples = static_cast<double>(samples_.size());
    for (std::size_t group = 0; group < groups_.size(); ++group) {
        std::array<double, 4> all_through{};
        for (const auto& through : through_)
            for (std::size_t o = 0; o < kOpacities; ++o)
                all_through[o] += through[o];
        std::array<double, kSize> seen{}, plain{};
        const std::span<const std::uint32_t> members = membersOf(group);
        for (std::size_t s = 0; s < samples_.size(); ++s) {
            if (members[s] == kNoFragment) continue;
            const C color = loadColor<C>(samples_[s].color, entries_[members[s]].fragment);
            std::array<double, 4>& through = through_[s];
            for (std::size_t i = 0; i < kSize; ++i) {
                seen[i] += through[opacityOf(i)] * static_cast<double>(color[i]);
                plain[i] += static_cast<double>(color[i]);
            }
            for (std::size_t o = 0; o < kOpacities; ++o)
                through[o] *= 1 - static_cast<double>(color[componentOf(o)]);
        }
        std::array<double, kSize> merged;
        for (std::size_t i = 0; i < kSize; ++i) {
            const double all = all_through[opacityOf(i)];
            merged[i] = all < kNothing ? plain[i] / samples : seen[i] / all;
        }
        if constexpr (kOpacities == 3) merged[3] = meanOpacity(merged[4], merged[5], merged[6]);
        const Entry& nearest = entries_[groups_[group]];
        row.z.push_back(nearest.z);
        row.nearest.emplace_back(nearest.sample, nearest.fragment);
        row.color.data.resize(row.z.size() * row.color.stride());
        TintedColor stored{};  // a plain colour uses the first four components
        std::ranges::transform(merged, stored.begin(),
                               [](double component) { return static_cast<float>(component); });
        storeColor(stored, row.color, row.z.size() - 1);
    }
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
    const FragmentArray no_colors{samples.front().color.channels, color_type, {}};
    std::vector<MergedRow> rows(height);
    out.window = window;
    out.offsets.assign(window.pixels() + 1, 0);
    parallelFor(height, [&](std::size_t y) {
        rows[y].color = no_colors;
        RowMerger merger(samples, surface_of);
        for (std::size_t pixel = y * width; pixel < (y + 1) * width; ++pixel)
            out.offsets[pixel + 1] = merger.merge(pixel, rows[y]);
    });
    std::partial_sum(out.offsets.begin(), out.offsets.end(), out.offsets.begin());
    const std::size_t fragments = out.offsets.back();
    out.z.resize(fragments);
    out.color = no_colors;
    out.color.data.resize(fragments * out.color.stride());
    const std::span<const FragmentArray> channels = std::span(samples.front().extra).subspan(1);
    out.extra.clear();
    for (const FragmentArray& like : channels) {
        FragmentArray& array = out.extra.emplace_back(FragmentArray{like.channels, like.type, {}});
        array.data.resize(fragments * array.stride());
    }
    parallelFor(height, [&](std::size_t y) {
        const MergedRow& row = rows[y];
        const std::size_t first = out.offsets[y * width];
        std::ranges::copy(row.z, out.z.data() + first);
        std::ranges::copy(row.color.data, out.color.data.data() + first * out.color.stride());
        for (std::size_t i = 0; i < channels.size(); ++i) {
            const std::size_t stride = channels[i].stride();
            std::byte* to = out.extra[i].data.data() + first * stride;
            for (const auto& [sample, from] : row.nearest) {
                std::memcpy(to, samples[sample].extra[1 + i].data.data() + from * stride, stride);
                to += stride;
            }
        }
    });
}

}  // namespace peeler
