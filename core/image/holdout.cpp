// SPDX-License-Identifier: Apache-2.0
#include "core/image/holdout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/image/composite.h"

namespace peeler {
namespace {

/// A value per colour channel.
using PerChannel = std::array<double, 3>;

constexpr PerChannel kNothingInFront = {1, 1, 1};

PerChannel opacityOf(const TintedColor& color) {
    PerChannel opacity{};
    for (std::size_t c = 0; c < 3; ++c)
        opacity[c] = std::clamp(static_cast<double>(color[4 + c]), 0.0, 1.0);
    return opacity;
}

/// The weights of one list's fragments, from front to back.
class Weights {
  public:
    /// Returns the weight of the next fragment. `opacity` is the fragment's opacity; `matte` is the
    /// transmittance of the matte in front of the fragment.
    PerChannel next(const PerChannel& opacity, const PerChannel& matte) {
        PerChannel weight{};
        for (std::size_t c = 0; c < 3; ++c) {
            weight[c] = ratio_[c] * matte[c];
            const double left = 1 - opacity[c] * weight[c];
            // Once everything is hidden, any ratio is right.
            ratio_[c] = left > 0 ? ratio_[c] * (1 - opacity[c]) / left : 1;
        }
        return weight;
    }

  private:
    PerChannel ratio_ = kNothingInFront;  ///< T / (1 − S), as holdOut() defines them
};

/// The transmittance of a matte's list at rising depths.
class MatteList {
  public:
    /// Reads the matte's list of fragments at `pixel`. `back` is the channel ZBack, if the matte
    /// has it.
    MatteList(const LayeredImage& matte, std::size_t pixel, const FragmentChannel& back)
        : matte_(matte), back_(back), next_(matte.offsets[pixel]), end_(matte.offsets[pixel + 1]) {}

    /// Returns the transmittance at depth `z`. From one call to the next, `z` must not decrease.
    PerChannel at(float z, SameDepth same_depth) {
        for (; next_ < end_; ++next_) {
            const float front = matte_.z[next_];
            if (front > z || (front == z && same_depth == SameDepth::kBehind)) break;
            const float back = back_ ? back_.value(next_) : front;
            const PerChannel opacity = opacityOf(tintedColorOf(matte_, next_));
            if (back > z)
                volumes_.push_back({front, back, opacity});
            else
                attenuate(passed_, opacity, 1);
        }
        PerChannel all = passed_;
        for (std::size_t i = 0; i < volumes_.size();) {
            const Volume& volume = volumes_[i];
            if (volume.back > z) {
                attenuate(all, volume.opacity,
                          (double{z} - volume.front) / (double{volume.back} - volume.front));
                ++i;
                continue;
            }
            attenuate(passed_, volume.opacity, 1);
            attenuate(all, volume.opacity, 1);
            volumes_[i] = volumes_.back();
            volumes_.pop_back();
        }
        return all;
    }

  private:
    struct Volume {
        float front, back;
        PerChannel opacity;
    };

    static void attenuate(PerChannel& transmittance, const PerChannel& opacity, double share) {
        for (std::size_t c = 0; c < 3; ++c)
            transmittance[c] *= share == 1 ? 1 - opacity[c] : std::pow(1 - opacity[c], share);
    }

    const LayeredImage& matte_;
    const FragmentChannel& back_;
    std::uint32_t next_, end_;
    PerChannel passed_ = kNothingInFront;  ///< transmittance of fragments ending before the depth
    std::vector<Volume> volumes_;          ///< volumes that contain the depth
};

/// Adds the channels AR, AG and AB to the colours.
void addColoredOpacity(LayeredImage& image) {
    FragmentArray colors{colorNames(true), image.color.type, {}};
    colors.data.resize(image.fragments() * colors.stride());
    for (std::size_t i = 0; i < image.fragments(); ++i)
        storeColor(tintedColorOf(image, i), colors, i);
    image.color = std::move(colors);
}

/// Multiplies a fragment's colour and opacity by the weights and returns true. Returns false if all
/// weights are 0.
bool weigh(LayeredImage& image, std::size_t fragment, TintedColor color, const PerChannel& weight) {
    if (weight == kNothingInFront) return true;
    if (weight == PerChannel{}) return false;
    for (std::size_t c = 0; c < 3; ++c) {
        color[c] = static_cast<float>(color[c] * weight[c]);
        color[4 + c] = static_cast<float>(color[4 + c] * weight[c]);
    }
    color[3] = meanOpacity(color[4], color[5], color[6]);
    storeColor(color, image.color, fragment);
    return true;
}

}  // namespace

void holdOut(LayeredImage& image, const LayeredImage& matte, SameDepth same_depth) {
    if (matte.tinted() && !image.tinted()) addColoredOpacity(image);
    const FragmentChannel back = findChannel(matte, "ZBack");
    std::vector<char> kept(image.fragments(), 1);
    const Window both = intersect(image.window, matte.window);
    for (int y = both.y0; y < both.y1; ++y) {
        for (int x = both.x0; x < both.x1; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            MatteList list(matte, matte.pixelIndex(x, y), back);
            Weights weights;
            for (std::uint32_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
                const TintedColor color = tintedColorOf(image, i);
                const PerChannel weight =
                    weights.next(opacityOf(color), list.at(image.z[i], same_depth));
                kept[i] = weigh(image, i, color, weight);
            }
        }
    }
    keepMarked(image, kept);
}

void holdOutSelected(LayeredImage& image, const ObjectSelection& selection) {
    const std::vector<char> selected = markObjects(image, selection);
    std::vector<char> kept(image.fragments(), 0);
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        PerChannel others = kNothingInFront;
        Weights weights;
        for (std::uint32_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
            const TintedColor color = tintedColorOf(image, i);
            const PerChannel opacity = opacityOf(color);
            if (selected[i]) {
                kept[i] = weigh(image, i, color, weights.next(opacity, others));
                continue;
            }
            for (std::size_t c = 0; c < 3; ++c)
                others[c] *= 1 - opacity[c];
        }
    }
    keepMarked(image, kept);
}

}  // namespace peeler
