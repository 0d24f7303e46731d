// SPDX-License-Identifier: Apache-2.0
#include "core/image/deep_curve.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <peeler/composite.h>

namespace peeler {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Opacity per unit of optical depth and colour per unit of depth of a volume, for one channel.
struct Density {
    double rate = 0, emission = 0;
};

Density densityOf(const DeepPiece& piece, std::size_t c) {
    const double length = piece.back - piece.front, opacity = piece.opacity[c];
    if (opacity <= 0) return {0, piece.color[c] / length};
    const double rate = -std::log1p(-opacity) / length;
    return {rate, piece.color[c] * rate / opacity};
}

/// Sets the members of a new piece, except its depths.
void setValues(const SampleLanes& lanes, std::size_t sample, DeepPiece& piece) {
    for (std::size_t c = 0; c < 3; ++c) {
        piece.color[c] = double{lanes.color[c]};
        piece.opacity[c] = double{lanes.opacity[c]};
    }
    piece.sample = static_cast<std::uint32_t>(sample);
}

/// Converts a half without branches.
float fromHalf(std::uint16_t half) {
    const std::uint32_t magnitude = (half & 0x7FFFU) << 13U;
    float value = std::bit_cast<float>(magnitude) * 0x1p112F;
    if (magnitude >= 0x0F800000U) value = std::bit_cast<float>(magnitude | 0x7F800000U);
    return (half & 0x8000U) != 0 ? -value : value;
}

/// Moves the opaque channels of a volume to a point at its front, where they hide everything, and
/// returns the point. The transmittance (1 − 1)^s is 0 for every s > 0.
DeepPiece splitOpaque(DeepPiece& volume) {
    volume.whole = false;
    DeepPiece point = volume;
    point.back = point.front;
    for (std::size_t c = 0; c < 3; ++c) {
        const bool opaque = volume.opacity[c] == 1;
        (opaque ? volume : point).opacity[c] = 0;
        (opaque ? volume : point).color[c] = 0;
    }
    return point;
}

bool isEmpty(const DeepPiece& piece) {
    constexpr std::array<double, 3> kNone{};
    return piece.opacity == kNone && piece.color == kNone;
}

bool isOpaque(const DeepPiece& piece) {
    return std::ranges::find(piece.opacity, 1.0) != piece.opacity.end();
}

/// Moves a state behind a piece.
void pass(DeepState& state, const DeepPiece& piece) {
    for (std::size_t c = 0; c < 3; ++c) {
        state[c] += state[3 + c] * piece.color[c];
        state[3 + c] *= 1 - piece.opacity[c];
    }
}

double largestColor(const DeepState& state) {
    return std::max({std::abs(state[0]), std::abs(state[1]), std::abs(state[2])});
}

/// The walk along a curve at rising depths.
class Cursor {
  public:
    explicit Cursor(const DeepCurve& curve) : pieces_(curve.pieces()), states_(curve.states()) {}

    /// Whether a volume contains the depths just behind `z`, which were passed.
    bool isInside(double z) const { return next_ < pieces_.size() && pieces_[next_].front <= z; }
    /// Returns the next depth behind `z` at which a piece begins or ends.
    double breakAfter(double z) const {
        if (next_ == pieces_.size()) return kNever;
        return pieces_[next_].front > z ? pieces_[next_].front : pieces_[next_].back;
    }
    /// Returns the state in front of all points at `z` that were not passed.
    DeepState at(double z) const {
        if (next_ == pieces_.size() || pieces_[next_].front >= z) return states_[next_];
        const DeepPiece& piece = pieces_[next_];
        return behind(states_[next_], piece,
                      std::min(1.0, (z - piece.front) / (piece.back - piece.front)));
    }
    void pass(double z) {
        while (next_ < pieces_.size() && pieces_[next_].back <= z)
            ++next_;
    }
    /// Returns the volume that contains the depth (isInside).
    const DeepPiece& inside() const { return pieces_[next_]; }

  private:
    std::span<const DeepPiece> pieces_;
    std::span<const DeepState> states_;
    std::size_t next_ = 0;
};

void compareStates(const DeepState& state, const DeepState& original, double z, double scale,
                   DeepDifference& worst) {
    const auto a = std::bit_cast<StateLanes>(state), b = std::bit_cast<StateLanes>(original);
    StateLanes differences = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    differences[0] = most(differences[0], -differences[0]) / scale;
    differences[1] = most(differences[1], -differences[1]) / TwoDoubles{scale, 1};
    differences[2] = most(differences[2], -differences[2]);
    const auto good = (differences[0] <= worst.error) & (differences[1] <= worst.error) &
                      (differences[2] <= worst.error);
    if ((good[0] & good[1]) != 0) return;
    const auto each = std::bit_cast<DeepState>(differences);
    for (std::size_t i = 0; i < each.size(); ++i)
        if (!(each[i] <= worst.error)) worst = {each[i], z, i, state[i], original[i]};
}

/// Compares two volumes between the depths `z` and `end`, where their slopes, which decay
/// exponentially, are equal.
void compareInside(const Cursor& a, const Cursor& b, double z, double end, double scale,
                   DeepDifference& worst) {
    const DeepState state_a = a.at(z), state_b = b.at(z);
    for (std::size_t i = 0; i < state_a.size(); ++i) {
        const double depth =
            z + distanceOfEqual(slopeOf(state_a, a.inside(), i), slopeOf(state_b, b.inside(), i));
        if (depth > z && depth < end) compareStates(a.at(depth), b.at(depth), depth, scale, worst);
    }
}

}  // namespace

std::string_view deepChannelName(std::size_t component, bool tinted) {
    return kColorNames[component < 3 ? component : tinted ? component + 1 : 3];
}

DeepState behind(const DeepState& state, const DeepPiece& piece, double share) {
    DeepState next = state;
    if (share == 1) {
        pass(next, piece);
        return next;
    }
    for (std::size_t c = 0; c < 3; ++c) {
        const double opacity = piece.opacity[c], front = state[3 + c];
        const double covered = opacity > 0 ? -std::expm1(share * std::log1p(-opacity)) : 0;
        next[c] += front * piece.color[c] * (opacity > 0 ? covered / opacity : share);
        next[3 + c] = front * (1 - covered);
    }
    return next;
}

DeepSlope slopeOf(const DeepState& state, const DeepPiece& volume, std::size_t component) {
    const std::size_t c = component % 3;
    const Density density = densityOf(volume, c);
    return {(component < 3 ? density.emission : -density.rate) * state[3 + c], density.rate};
}

double distanceOfEqual(const DeepSlope& a, const DeepSlope& b) {
    return std::log(a.change / b.change) / (a.rate - b.rate);
}

bool DeepCurve::read(const DeepSamples& samples) {
    pieces_.clear();
    volumes_ = false;
    bool overlap = false;
    double farthest = -kNever;
    double odd = 0;  // NaN if a depth is NaN or infinite
    MeaningCheck meaning;
    for (std::size_t i = 0; i < samples.z.size(); ++i) {
        const SampleLanes lanes = samples.lanes(i);
        meaning.add(lanes);
        DeepPiece* piece = &pieces_.emplace_back();
        setValues(lanes, samples.first + i, *piece);
        piece->front = piece->back = double{samples.z[i]};
        if (!samples.back.empty()) piece->back = std::max(piece->front, double{samples.back[i]});
        odd += (piece->front - piece->front) + (piece->back - piece->back);
        if (piece->volume() && isOpaque(*piece)) {
            DeepPiece volume = *piece;
            *piece = splitOpaque(volume);
            if (!isEmpty(volume)) piece = &pieces_.emplace_back(volume);
        }
        volumes_ = volumes_ || piece->volume();
        overlap = overlap || piece->front < farthest;
        farthest = std::max(farthest, piece->back);
    }
    if (odd != 0 || !meaning.holds()) return false;
    if (overlap) splitVolumes();
    accumulate();
    return true;
}

/// Splits all pieces at the ends of the volumes, and merges the volumes between two ends.
void DeepCurve::splitVolumes() {
    std::swap(pieces_, unsplit_);
    pieces_.clear();
    open_.clear();
    cuts_.clear();
    for (const DeepPiece& piece : unsplit_) {
        cuts_.push_back(piece.front);
        cuts_.push_back(piece.back);
    }
    std::sort(cuts_.begin(), cuts_.end());
    cuts_.erase(std::unique(cuts_.begin(), cuts_.end()), cuts_.end());
    std::size_t next = 0;
    for (std::size_t i = 0; i < cuts_.size(); ++i) {
        std::erase_if(open_, [&](const DeepPiece& piece) { return piece.back <= cuts_[i]; });
        for (; next < unsplit_.size() && unsplit_[next].front == cuts_[i]; ++next)
            (unsplit_[next].volume() ? open_ : pieces_).push_back(unsplit_[next]);
        if (!open_.empty()) emitVolumes(open_, cuts_[i], cuts_[i + 1]);
    }
}

/// Appends the part between two depths of the volumes that contain it, as one piece.
void DeepCurve::emitVolumes(std::span<const DeepPiece> open, double front, double back) {
    DeepPiece merged{front, back, {}, {}, open.front().sample, false};
    for (std::size_t c = 0; c < 3; ++c) {
        Density sum;
        for (const DeepPiece& piece : open) {
            const Density density = densityOf(piece, c);
            sum.rate += density.rate;
            sum.emission += density.emission;
        }
        const double length = back - front;
        merged.opacity[c] = -std::expm1(-sum.rate * length);
        merged.color[c] =
            sum.rate > 0 ? sum.emission * merged.opacity[c] / sum.rate : sum.emission * length;
    }
    pieces_.push_back(merged);
}

void DeepCurve::mergePoints() {
    const auto coincide = [](const DeepPiece& a, const DeepPiece& b) {
        return a.front == b.front && !a.volume() && !b.volume();
    };
    if (std::ranges::adjacent_find(pieces_, coincide) == pieces_.end()) return;
    std::size_t last = 0;
    for (std::size_t i = 1; i < pieces_.size(); ++i) {
        DeepPiece& into = pieces_[last];
        const DeepPiece& piece = pieces_[i];
        if (!coincide(into, piece)) {
            pieces_[++last] = piece;
            continue;
        }
        into.whole = false;
        for (std::size_t c = 0; c < 3; ++c) {
            into.color[c] += (1 - into.opacity[c]) * piece.color[c];
            into.opacity[c] += (1 - into.opacity[c]) * piece.opacity[c];
        }
    }
    pieces_.resize(last + 1);
    accumulate();
}

void DeepCurve::accumulate() {
    DeepState state = kDeepStart;
    states_.assign(1, state);
    states_.reserve(pieces_.size() + 1);
    scale_ = 1;
    for (const DeepPiece& piece : pieces_) {
        pass(state, piece);
        scale_ = std::max(scale_, largestColor(state));
        states_.push_back(state);
    }
}

DeepState DeepCurve::at(double z) const {
    Cursor cursor(*this);
    cursor.pass(z);
    return cursor.at(z);
}

/// Compares two lists of points.
void comparePoints(const DeepCurve& curve, const DeepCurve& original, double scale,
                   DeepDifference& worst) {
    const std::span<const DeepPiece> a = curve.pieces(), b = original.pieces();
    for (std::size_t i = 0, k = 0; i < a.size() || k < b.size();) {
        const double z =
            std::min(i < a.size() ? a[i].front : kNever, k < b.size() ? b[k].front : kNever);
        while (i < a.size() && a[i].front == z)
            ++i;
        while (k < b.size() && b[k].front == z)
            ++k;
        compareStates(curve.states()[i], original.states()[k], z, scale, worst);
    }
}

DeepDifference largestDifference(const DeepCurve& curve, const DeepCurve& original) {
    if (!curve.hasVolumes() && !original.hasVolumes()) {
        DeepDifference worst;
        comparePoints(curve, original, original.colorScale(), worst);
        return worst;
    }
    Cursor a(curve), b(original);
    const double scale = original.colorScale();
    DeepDifference worst;
    double z = -kNever;
    for (;;) {
        const double end = std::min(a.breakAfter(z), b.breakAfter(z));
        if (end == kNever) return worst;
        const bool in_a = a.isInside(z), in_b = b.isInside(z);
        if (in_a && in_b) compareInside(a, b, z, end, scale, worst);
        if (in_a || in_b) compareStates(a.at(end), b.at(end), end, scale, worst);
        z = end;
        a.pass(z);
        b.pass(z);
        compareStates(a.at(z), b.at(z), z, scale, worst);
    }
}

DeepFloats::DeepFloats(const LayeredImage& image)
    : image_(image), back_(findChannel(image, "ZBack")) {}

void DeepFloats::convert(std::size_t begin, std::size_t end) {
    const std::size_t components = image_.color.components();
    const auto offset = static_cast<std::ptrdiff_t>(begin * components);
    first_ = begin;
    colors_.resize((end - begin) * components);
    if (image_.color.type == PixelType::kFloat)
        std::copy_n(image_.color.as<float>().begin() + offset, colors_.size(), colors_.begin());
    else
        std::transform(image_.color.as<std::uint16_t>().begin() + offset,
                       image_.color.as<std::uint16_t>().begin() + offset +
                           static_cast<std::ptrdiff_t>(colors_.size()),
                       colors_.begin(), fromHalf);
    backs_.clear();
    for (std::size_t f = begin; back_ && f < end; ++f)
        backs_.push_back(back_.value(f));
}

DeepSamples DeepFloats::samples(std::size_t begin, std::size_t end) const {
    const std::size_t components = image_.color.components(), count = end - begin;
    const std::span<const float> colors(colors_), backs(backs_), z(image_.z);
    return {z.subspan(begin, count),
            back_ ? backs.subspan(begin - first_, count) : std::span<const float>(),
            colors.subspan((begin - first_) * components, count * components), image_.tinted(),
            begin};
}

DeepComparison::DeepComparison(const LayeredImage& image, const LayeredImage& original)
    : image_(image), original_(original), floats_(image), original_floats_(original) {}

DeepDifference DeepComparison::operator()(std::size_t pixel, std::size_t original_pixel) {
    const auto read = [](DeepFloats& floats, const LayeredImage& image, std::size_t p) {
        floats.convert(image.offsets[p], image.offsets[p + 1]);
        return floats.samples(image.offsets[p], image.offsets[p + 1]);
    };
    const DeepSamples samples = read(floats_, image_, pixel);
    const DeepSamples original = read(original_floats_, original_, original_pixel);
    const auto same = [](std::span<const float> a, std::span<const float> b) {
        return a.size() == b.size() &&
               (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
    };
    if (samples.tinted == original.tinted && same(samples.z, original.z) &&
        same(samples.back, original.back) && same(samples.colors, original.colors))
        return {};
    if (curve_.read(samples) && original_curve_.read(original))
        return largestDifference(curve_, original_curve_);
    const float z = samples.z.empty() ? original.z[0] : samples.z[0];
    return {kNever, double{z}, 0, std::nan(""), std::nan("")};
}

}  // namespace peeler
