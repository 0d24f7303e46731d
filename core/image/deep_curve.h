// SPDX-License-Identifier: Apache-2.0
// Accumulated colour and transmittance of a pixel's deep samples as functions of depth.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include <peeler/layered_image.h>
#include "core/base/lanes.h"

namespace peeler {

/// What lies in front of a depth: premultiplied R, G, B, then the transmittance for R, G, B.
using DeepState = std::array<double, 6>;
inline constexpr DeepState kDeepStart = {0, 0, 0, 1, 1, 1};

/// The components of a state in pairs.
using StateLanes = std::array<TwoDoubles, 3>;

/// Returns the OpenEXR channel that a component of DeepState belongs to: R, G, B, or the opacity A
/// or AR, AG, AB.
std::string_view deepChannelName(std::size_t component, bool tinted);

/// A point sample (`front` equals `back`) or a volume sample, in scene units.
struct DeepPiece {
    double front = 0, back = 0;
    std::array<double, 3> opacity{}, color{};
    std::uint32_t sample = 0;  ///< index of the nearest fragment of the piece
    bool whole = true;         ///< whether the piece is exactly that fragment

    bool volume() const { return back > front; }
};

/// Returns the state behind the first `share` (0–1) of a piece: transmittance is (1 − α)^s, colour
/// grows with opacity ("Interpreting OpenEXR Deep Pixels", section "Splitting a Volumetric
/// Sample").
DeepState behind(const DeepState& state, const DeepPiece& piece, double share = 1);

/// The change of a component per unit of depth at the front of a range, which decays by the factor
/// exp(−rate · depth).
struct DeepSlope {
    double change = 0, rate = 0;
};
DeepSlope slopeOf(const DeepState& state, const DeepPiece& volume, std::size_t component);
/// Returns the distance at which two slopes are equal, where the difference of the components has
/// its extreme. If there is no such distance, returns NaN or a distance outside the range.
double distanceOfEqual(const DeepSlope& a, const DeepSlope& b);

/// The values of a sample: R, G, B, and B again.
struct SampleLanes {
    FourFloats color, opacity;
};

/// Whether all values are finite, and all opacities within 0–1, of the samples added so far.
class MeaningCheck {
  public:
    void add(const SampleLanes& sample) {
        odd_ += sample.color * 0 + sample.opacity * 0;
        low_ = least(sample.opacity, low_);
        high_ = most(sample.opacity, high_);
    }
    bool holds() const {
        bool good = true;
        for (int c = 0; c < 3; ++c)
            good = good && odd_[c] == 0 && low_[c] >= 0 && high_[c] <= 1;
        return good;
    }

  private:
    FourFloats odd_{}, low_{}, high_{};  // odd: 0 for numbers, NaN for NaN and infinity
};

/// A pixel's samples, sorted by Z, with their values as floats: R, G, B, A or, with coloured
/// opacity, all components of LayeredImage::color.
struct DeepSamples {
    std::span<const float> z;
    std::span<const float> back;  ///< ZBack; empty for points
    std::span<const float> colors;
    bool tinted = false;
    std::size_t first = 0;  ///< index of the first sample in the image

    SampleLanes lanes(std::size_t i) const {
        const float* const at = &colors[i * colorComponents(tinted)];
        FourFloats front, rest;
        std::memcpy(&front, at, sizeof(front));
        std::memcpy(&rest, at + (tinted ? 3 : 0), sizeof(rest));
        return {__builtin_shufflevector(front, front, 0, 1, 2, 2),
                tinted ? __builtin_shufflevector(rest, rest, 1, 2, 3, 3)
                       : __builtin_shufflevector(rest, rest, 3, 3, 3, 3)};
    }
};

/// The samples of a pixel as pieces that do not overlap in depth, and the states between them.
/// Overlapping volumes are split at each other's ends and merged ("Interpreting OpenEXR Deep
/// Pixels", "Merging Overlapping Samples"), in double precision. Reading a new pixel reuses the
/// storage.
class DeepCurve {
  public:
    /// Reads a pixel. Returns false, and leaves the curve invalid, if a value is not finite or an
    /// opacity is not within 0–1: such samples have no meaning as layers.
    bool read(const DeepSamples& samples);
    /// Takes no pieces.
    void clear() { assign(std::span<const DeepPiece>(), std::identity()); }
    /// Takes piece_of(item) for a range of items: pieces that do not overlap, front to back.
    template <class Items, class PieceOf>
    void assign(const Items& items, PieceOf&& piece_of) {
        pieces_.clear();
        for (const auto& item : items)
            pieces_.push_back(piece_of(item));
        volumes_ = std::ranges::any_of(pieces_, &DeepPiece::volume);
        accumulate();
    }
    /// Merges the points at each depth into one piece: no depth lies between them.
    void mergePoints();

    std::span<const DeepPiece> pieces() const { return pieces_; }
    /// The state in front of piece k is states()[k]; the last entry is the state behind all pieces.
    std::span<const DeepState> states() const { return states_; }
    bool hasVolumes() const { return volumes_; }
    /// Returns the state behind all samples at a depth.
    DeepState at(double z) const;
    /// The unit of colour errors: 1, or the largest absolute accumulated colour if it exceeds 1.
    double colorScale() const { return scale_; }

  private:
    void splitVolumes();
    void emitVolumes(std::span<const DeepPiece> open, double front, double back);
    void accumulate();

    std::vector<DeepPiece> pieces_, unsplit_, open_;
    std::vector<DeepState> states_;
    std::vector<double> cuts_;
    bool volumes_ = false;
    double scale_ = 1;
};

/// The largest difference between two pixels over all depths and components.
struct DeepDifference {
    double error = 0;  ///< in the norm of largestDifference()
    double z = 0;
    std::size_t component = 0;  ///< of DeepState
    double value = 0, original = 0;

    void add(const DeepDifference& other) {
        if (other.error > error) *this = other;
    }
};

/// Returns the largest difference at any depth, in front of or behind the samples there. The norm
/// is the absolute difference of transmittance, and that of accumulated premultiplied colour
/// divided by `original.colorScale()`. Extremes inside volumes are found analytically.
DeepDifference largestDifference(const DeepCurve& curve, const DeepCurve& original);

/// The samples of some pixels of an image as floats. Keeps its storage.
class DeepFloats {
  public:
    explicit DeepFloats(const LayeredImage& image);
    /// Converts the fragments [begin, end).
    void convert(std::size_t begin, std::size_t end);
    /// Returns the fragments [begin, end), which are among the converted ones.
    DeepSamples samples(std::size_t begin, std::size_t end) const;

  private:
    const LayeredImage& image_;
    FragmentChannel back_;
    std::size_t first_ = 0;
    std::vector<float> colors_, backs_;
};

/// Returns largestDifference() of two pixels of images. Pixels with equal bits do not differ,
/// whatever their values; otherwise values without meaning (DeepCurve::read) differ by infinity.
class DeepComparison {
  public:
    DeepComparison(const LayeredImage& image, const LayeredImage& original);
    /// `pixel` and `original_pixel` are indices into the images' pixels.
    DeepDifference operator()(std::size_t pixel, std::size_t original_pixel);

  private:
    const LayeredImage &image_, &original_;
    DeepFloats floats_, original_floats_;
    DeepCurve curve_, original_curve_;
};

}  // namespace peeler
