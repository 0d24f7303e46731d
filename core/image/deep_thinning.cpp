// SPDX-License-Identifier: Apache-2.0
#include "core/image/deep_thinning.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "core/image/deep_curve.h"
#include "core/image/fragment_copies.h"

namespace peeler {
namespace {

/// A sample of the result. Its values are as stored; `whole` means a copy of the fragment.
using ThinSample = DeepPiece;

/// A quick look at a pixel of point samples.
struct Glance {
    std::size_t visible = 0;  ///< number of samples up to the first opaque one
    bool may_merge = false;   ///< whether two successive states may be near enough to merge
};

/// Finds the pixels that need no thinning, or only lose hidden samples. `error` is twice the bound.
/// Values without meaning (DeepCurve::read) keep all samples. Single precision misses only pairs
/// that differ by just the bound, at half the time.
template <bool Tinted>
Glance glance(const DeepSamples& samples, float error) {
    constexpr std::size_t kStride = colorComponents(Tinted);
    constexpr std::size_t kFirst = Tinted ? 4 : 3, kNext = Tinted ? 1 : 0;
    const std::span<const float> z = samples.z;
    const float* color = samples.colors.data();
    std::array<float, 3> sum{}, largest{}, odd{}, low{}, high{}, rest{1, 1, 1};
    float least = std::numeric_limits<float>::infinity();
    Glance seen{z.size(), false};
    bool coincident = false, opaque = false;
    for (std::size_t i = 0; i < z.size(); ++i, color += kStride) {
        std::array<float, 3> gain, covered;
        for (std::size_t c = 0; c < 3; ++c) {
            const float opacity = color[kFirst + c * kNext];
            gain[c] = rest[c] * color[c];
            covered[c] = rest[c] * opacity;
            sum[c] += gain[c];
            gain[c] = std::abs(gain[c]);
            largest[c] = std::max(largest[c], std::abs(sum[c]));
            odd[c] += (color[c] - color[c]) + (opacity - opacity);  // NaN for infinity, too
            low[c] = std::min(low[c], opacity);
            high[c] = std::max(high[c], opacity);
            rest[c] = opacity == 1 ? 0 : rest[c] * (1 - opacity);
        }
        if (opaque) continue;
        coincident = coincident || (i > 0 && z[i] == z[i - 1]);
        if (std::max({covered[0], covered[1], covered[2]}) <= error)
            least = std::min(least, std::max({gain[0], gain[1], gain[2]}));
        opaque = rest[0] + rest[1] + rest[2] == 0;
        if (opaque) seen.visible = i + 1;
    }
    for (std::size_t c = 0; c < 3; ++c)
        if (!(odd[c] == 0 && low[c] >= 0 && high[c] <= 1)) return {z.size(), false};
    const float scale = std::max({1.0F, largest[0], largest[1], largest[2]});
    seen.may_merge = coincident || least <= error * scale;
    return seen;
}

/// The least and the greatest state of a run.
struct StateRange {
    DeepState least, greatest;

    explicit StateRange(const DeepState& state) : least(state), greatest(state) {}
    void add(const DeepState& state) {
        for (std::size_t i = 0; i < state.size(); ++i) {
            least[i] = std::min(least[i], state[i]);
            greatest[i] = std::max(greatest[i], state[i]);
        }
    }
};

/// Returns the largest opacity below 1, which lets colour be added behind a sample.
double largestBelowOpaque(PixelType type) {
    return type == PixelType::kHalf ? 1 - 0x1p-11 : 1 - 0x1p-24;
}

double rounded(double value, PixelType type) {
    const auto single = static_cast<float>(value);
    if (type == PixelType::kFloat) return double{single};
    return double{imath_half_to_float(imath_float_to_half(single))};
}

/// The thinning of one pixel after another. Keeps its storage.
class PixelThinner {
  public:
    PixelThinner(const LayeredImage& image, const DeepMergeSettings& settings);

    /// Thins a pixel. Returns false if its samples must stay as they are.
    bool thin(const DeepSamples& samples);
    std::span<const ThinSample> samples() const { return samples_; }
    /// Returns the largest error of the samples, whose values are those to be stored.
    double error();

  private:
    struct Step {
        ThinSample sample;
        DeepState state;      ///< behind the sample
        std::size_t end = 0;  ///< number of pieces that the steps so far account for
    };

    void setBounds(std::size_t fragments);
    bool walk();
    bool walkObjects();
    bool isNear(const DeepState& a, const DeepState& b) const;
    bool fits(const StateRange& run, std::size_t end) const;
    bool isPinned(std::size_t c, std::size_t end) const { return opaque_[c] && end == pieces_; }
    std::size_t hold(std::size_t piece) const;
    std::optional<Step> point(std::size_t piece) const;
    bool settle(const StateRange& run, Step& step) const;
    std::optional<Step> volume(std::size_t piece) const;
    std::optional<Step> fitVolume(std::size_t piece, std::size_t last) const;
    std::optional<double> fitOpacity(std::size_t piece, std::size_t last, std::size_t c) const;
    std::optional<double> fitColor(const ThinSample& sample, std::size_t piece, std::size_t last,
                                   std::size_t c) const;
    bool holdsInside(const ThinSample& sample, std::size_t piece, std::size_t last) const;
    bool isSameObject(std::uint32_t a, std::uint32_t b) const;
    Step objectStep(std::size_t piece) const;
    double opacityNear(double opacity, bool pinned) const;
    std::optional<Step> copyOf(std::size_t piece) const;

    const LayeredImage& image_;
    const DeepMergeSettings& settings_;
    FragmentChannel objects_, materials_;
    bool can_store_volumes_ = false;
    DeepCurve curve_, stored_;
    std::vector<ThinSample> samples_;
    DeepState bounds_{};            ///< the largest error of each component
    std::array<bool, 3> opaque_{};  ///< whether the pixel ends exactly opaque
    bool no_negative_ = false;      ///< whether no colour is negative
    std::size_t pieces_ = 0;        ///< number of pieces that change the state
    DeepState state_ = kDeepStart;  ///< behind the samples so far, as rounded
};

PixelThinner::PixelThinner(const LayeredImage& image, const DeepMergeSettings& settings)
    : image_(image), settings_(settings) {
    const FragmentChannel back = findChannel(image, "ZBack");
    can_store_volumes_ = back && back.type() == PixelType::kFloat;
    if (!settings.keep_ids) return;
    objects_ = findIds(image, "id.object");
    materials_ = findIds(image, "id.material");
    if (!objects_)
        throw Error(ErrorKind::kUsage, "the samples have no channel id.object to keep apart",
                    Parameter::kDeepKeep, "add " + Parameter::kChannels + " id, or leave it out");
}

bool PixelThinner::thin(const DeepSamples& samples) {
    const std::size_t count = samples.z.size();
    samples_.clear();
    state_ = kDeepStart;
    if (count < 2 || !curve_.read(samples)) return false;
    if (curve_.hasVolumes() && (!can_store_volumes_ || settings_.keep_ids)) return false;
    if (!settings_.keep_ids) curve_.mergePoints();
    setBounds(count);
    const bool done = settings_.keep_ids ? walkObjects() : walk();
    return done && samples_.size() < count;
}

void PixelThinner::setBounds(std::size_t fragments) {
    const double error =
        std::max(settings_.error / 2, settings_.error - 0x1p-23 * static_cast<double>(fragments));
    const double scale = curve_.colorScale();
    bounds_ = {error * scale, error * scale, error * scale, error, error, error};
    const std::span<const DeepState> states = curve_.states();
    for (std::size_t c = 0; c < 3; ++c)
        opaque_[c] = states.back()[3 + c] == 0;
    no_negative_ = std::ranges::all_of(curve_.pieces(), [](const DeepPiece& piece) {
        return *std::ranges::min_element(piece.color) >= 0;
    });
    // Pieces behind an opaque one change nothing.
    pieces_ = curve_.pieces().size();
    while (pieces_ > 0 && states[pieces_] == states[pieces_ - 1])
        --pieces_;
}

bool PixelThinner::isNear(const DeepState& a, const DeepState& b) const {
    bool near = true;
    for (std::size_t i = 0; i < a.size(); ++i)
        near = near && std::abs(a[i] - b[i]) <= bounds_[i];
    return near;
}

/// Whether one state can stand for a run that ends behind piece `end` − 1.
bool PixelThinner::fits(const StateRange& run, std::size_t end) const {
    bool good = true;
    for (std::size_t i = 0; i < bounds_.size(); ++i)
        good = good && run.greatest[i] - run.least[i] <= 2 * bounds_[i];
    for (std::size_t c = 0; c < 3; ++c)
        good = good && !(isPinned(c, end) && run.greatest[3 + c] > bounds_[3 + c]);
    return good;
}

bool PixelThinner::walk() {
    const bool volumes = curve_.hasVolumes();
    for (std::size_t piece = hold(0); piece < pieces_; piece = hold(piece)) {
        std::optional<Step> step = point(piece);
        if (volumes) {
            std::optional<Step> other = volume(piece);
            if (other && (!step || other->end > step->end)) step = other;
        }
        if (!step) return false;
        samples_.push_back(step->sample);
        state_ = step->state;
        piece = step->end;
    }
    return true;
}

/// Returns the first piece from `piece` on behind which the present state is too far off.
std::size_t PixelThinner::hold(std::size_t piece) const {
    const std::span<const DeepState> states = curve_.states();
    for (; piece < pieces_ && isNear(state_, states[piece + 1]); ++piece) {
        for (std::size_t c = 0; c < 3; ++c)
            if (isPinned(c, piece + 1) && state_[3 + c] != 0) return piece;
    }
    return piece;
}

/// Returns the original sample if it leads from the present state exactly to the next.
std::optional<PixelThinner::Step> PixelThinner::copyOf(std::size_t piece) const {
    if (!curve_.pieces()[piece].whole || state_ != curve_.states()[piece]) return {};
    return Step{curve_.pieces()[piece], curve_.states()[piece + 1], piece + 1};
}

/// Returns a point at the front of a piece, and the farthest run that it can begin.
std::optional<PixelThinner::Step> PixelThinner::point(std::size_t piece) const {
    const DeepPiece& at = curve_.pieces()[piece];
    const std::span<const DeepState> states = curve_.states();
    const std::size_t first = at.volume() ? piece : piece + 1;
    std::size_t end = first;
    for (StateRange run(states[first]); end < pieces_; ++end) {
        run.add(states[end + 1]);
        if (!fits(run, end + 1)) break;
    }
    if (end == piece) return {};
    if (end == piece + 1 && !at.volume())
        if (std::optional<Step> copy = copyOf(piece)) return copy;
    for (; end > piece; --end) {
        StateRange run(states[first]);
        for (std::size_t i = first + 1; i <= end; ++i)
            run.add(states[i]);
        Step step{{at.front, at.front, {}, {}, at.sample, false}, state_, end};
        if (settle(run, step)) return step;
    }
    return {};
}

/// Returns the nearest opacity that can be stored. Only if `pinned`, it is 1.
double PixelThinner::opacityNear(double opacity, bool pinned) const {
    if (pinned) return 1;
    const PixelType type = image_.color.type;
    return std::clamp(rounded(opacity, type), 0.0, largestBelowOpaque(type));
}

/// Sets a point's values such that the state behind it stands for a run. Returns false if rounding
/// does not allow it.
bool PixelThinner::settle(const StateRange& run, Step& step) const {
    bool good = true;
    for (std::size_t i = bounds_.size(); i-- > 0;) {
        const std::size_t c = i % 3;
        const double front = state_[3 + c];
        const double middle = (run.least[i] + run.greatest[i]) / 2;
        if (i >= 3) {
            const bool pinned = run.greatest[i] == 0 || isPinned(c, step.end);
            step.sample.opacity[c] = opacityNear(front > 0 ? 1 - middle / front : 1, pinned);
            step.state[i] = front * (1 - step.sample.opacity[c]);
        } else {
            double color = front > 0 ? rounded((middle - state_[i]) / front, image_.color.type) : 0;
            if (no_negative_) color = std::max(color, 0.0);
            step.sample.color[c] = color;
            step.state[i] = state_[i] + front * color;
        }
        good = good && step.state[i] >= run.greatest[i] - bounds_[i] &&
               step.state[i] <= run.least[i] + bounds_[i];
    }
    return good;
}

/// Returns the volume from the front of a piece that reaches farthest.
std::optional<PixelThinner::Step> PixelThinner::volume(std::size_t piece) const {
    const bool flat = !curve_.pieces()[piece].volume();
    std::optional<Step> best;
    std::size_t good = piece, bad = pieces_;  // the last pieces that fit and do not fit
    for (std::size_t length = flat ? 2 : 1; piece + length <= pieces_; length *= 2) {
        std::optional<Step> step = fitVolume(piece, piece + length - 1);
        if (!step) {
            bad = piece + length - 1;
            break;
        }
        best = step;
        good = piece + length - 1;
    }
    while (best && bad - good > 1) {
        const std::size_t middle = good + (bad - good) / 2;
        const std::optional<Step> step = fitVolume(piece, middle);
        (step ? good : bad) = middle;
        if (step) best = step;
    }
    return best;
}

/// Returns the volume from the front of `piece` to the back of `last`, if its error is small enough
/// everywhere.
std::optional<PixelThinner::Step> PixelThinner::fitVolume(std::size_t piece,
                                                          std::size_t last) const {
    const std::span<const DeepPiece> pieces = curve_.pieces();
    if (last == piece)
        if (std::optional<Step> copy = copyOf(piece)) return copy;
    Step step{{pieces[piece].front, pieces[last].back, {}, {}, pieces[piece].sample, false},
              state_,
              last + 1};
    for (std::size_t c = 0; c < 3; ++c) {
        if (isPinned(c, step.end)) return {};
        const std::optional<double> opacity = fitOpacity(piece, last, c);
        if (!opacity) return {};
        step.sample.opacity[c] = *opacity;
        const std::optional<double> color = fitColor(step.sample, piece, last, c);
        if (!color) return {};
        step.sample.color[c] = *color;
    }
    step.state = behind(state_, step.sample);
    if (!holdsInside(step.sample, piece, last)) return {};
    return step;
}

/// Calls visit(depth, state) for the original's states at both ends of the pieces of a range.
template <class Visit>
void forEachEnd(const DeepCurve& curve, std::size_t piece, std::size_t last, Visit&& visit) {
    for (std::size_t i = piece; i <= last; ++i) {
        visit(curve.pieces()[i].front, curve.states()[i]);
        visit(curve.pieces()[i].back, curve.states()[i + 1]);
    }
}

/// Returns the opacity whose transmittance stays within the bound at all ends, and if possible ends
/// at the original's. Transmittance is exp(−rate · distance), so each end bounds the rate.
std::optional<double> PixelThinner::fitOpacity(std::size_t piece, std::size_t last,
                                               std::size_t c) const {
    const double front = curve_.pieces()[piece].front, now = state_[3 + c];
    const double length = curve_.pieces()[last].back - front, bound = bounds_[3 + c];
    if (!(now > 0)) return 0.0;
    double least = 0, greatest = std::numeric_limits<double>::infinity();
    forEachEnd(curve_, piece, last, [&](double z, const DeepState& state) {
        const double there = state[3 + c];
        if (z == front) {
            if (std::abs(now - there) > bound) greatest = -1;
            return;
        }
        least = std::max(least, std::log(now / (there + bound)) / (z - front));
        if (there > bound)
            greatest = std::min(greatest, std::log(now / (there - bound)) / (z - front));
    });
    if (least > greatest) return {};
    const double wanted = std::log(now / curve_.states()[last + 1][3 + c]) / length;
    const double rate = std::clamp(wanted, least, greatest);
    return opacityNear(-std::expm1(-rate * length), false);
}

/// Returns the colour of a volume of known opacity that stays within the bound at all ends, and if
/// possible ends at the original's. Colour is proportional to the share of the light (behind()).
std::optional<double> PixelThinner::fitColor(const ThinSample& sample, std::size_t piece,
                                             std::size_t last, std::size_t c) const {
    if (!(state_[3 + c] > 0)) return 0.0;
    ThinSample unit = sample;
    unit.color[c] = 1;
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double least = no_negative_ ? 0 : -kNone, greatest = kNone, wanted = 0;
    forEachEnd(curve_, piece, last, [&](double z, const DeepState& state) {
        const double gain = state[c] - state_[c];
        if (z == sample.front) {
            if (std::abs(gain) > bounds_[c]) greatest = -kNone;
            return;
        }
        const double share = (z - sample.front) / (sample.back - sample.front);
        const double there = behind(state_, unit, share)[c] - state_[c];
        least = std::max(least, (gain - bounds_[c]) / there);
        greatest = std::min(greatest, (gain + bounds_[c]) / there);
        wanted = gain / there;
    });
    if (least > greatest) return {};
    return rounded(std::clamp(wanted, least, greatest), image_.color.type);
}

/// Whether a volume's rounded values stay within the bound at all depths of a range of pieces.
bool PixelThinner::holdsInside(const ThinSample& sample, std::size_t piece,
                               std::size_t last) const {
    const auto at = [&](double z) {
        return behind(state_, sample, (z - sample.front) / (sample.back - sample.front));
    };
    bool good = true;
    forEachEnd(curve_, piece, last, [&](double z, const DeepState& state) {
        good = good && isNear(z == sample.front ? state_ : at(z), state);
    });
    for (std::size_t i = piece; i <= last && good; ++i) {
        const DeepPiece& original = curve_.pieces()[i];
        if (!original.volume()) continue;
        const DeepState& from = curve_.states()[i];
        const DeepState ours = original.front == sample.front ? state_ : at(original.front);
        const double length = original.back - original.front;
        for (std::size_t c = 0; c < ours.size(); ++c) {
            const double distance =
                distanceOfEqual(slopeOf(ours, sample, c), slopeOf(from, original, c));
            if (distance > 0 && distance < length)
                good = good && isNear(at(original.front + distance),
                                      behind(from, original, distance / length));
        }
    }
    return good;
}

bool PixelThinner::isSameObject(std::uint32_t a, std::uint32_t b) const {
    return objects_.id(a) == objects_.id(b) &&
           (!materials_ || materials_.id(a) == materials_.id(b));
}

/// Returns the longest run of samples of one object that one sample can stand for. In front of it
/// the original's states must be near the present one, behind it near the run's last.
PixelThinner::Step PixelThinner::objectStep(std::size_t piece) const {
    const std::span<const DeepPiece> pieces = curve_.pieces();
    const std::span<const DeepState> states = curve_.states();
    std::size_t at = piece;  // the piece at which the sample stands
    std::size_t end = piece + 1;
    const auto fits_behind = [&](std::size_t last) {
        for (std::size_t i = at + 1; i < last; ++i)
            if (!isNear(states[i], states[last])) return false;
        return true;
    };
    while (end < pieces_ && isSameObject(pieces[piece].sample, pieces[end].sample)) {
        if (at + 1 == end && isNear(state_, states[end]))
            ++at;
        else if (!fits_behind(end + 1))
            break;
        ++end;
    }
    return {{pieces[at].front, pieces[at].front, {}, {}, pieces[at].sample, false}, state_, end};
}

bool PixelThinner::walkObjects() {
    for (std::size_t piece = 0; piece < pieces_;) {
        Step step = objectStep(piece);
        const std::optional<Step> copy = step.end == piece + 1 ? copyOf(piece) : std::nullopt;
        if (copy)
            step = *copy;
        else if (!settle(StateRange(curve_.states()[step.end]), step))
            return false;
        samples_.push_back(step.sample);
        state_ = step.state;
        piece = step.end;
    }
    return true;
}

double PixelThinner::error() {
    stored_.assign(samples_);
    return largestDifference(stored_, curve_).error;
}

/// A sample of the result, as stored.
struct StoredSample {
    explicit StoredSample(const ThinSample& thin)
        : front(static_cast<float>(thin.front)),
          back(static_cast<float>(thin.back)),
          sample(thin.sample),
          whole(thin.whole) {
        for (std::size_t c = 0; c < 3; ++c) {
            color[c] = static_cast<float>(thin.color[c]);
            opacity[c] = static_cast<float>(thin.opacity[c]);
        }
    }
    float front, back;
    std::array<float, 3> color{}, opacity{};
    std::uint32_t sample;
    bool whole;
};

/// The samples of the pixels of a row that were thinned, one pixel after another.
struct ThinRow {
    std::vector<std::size_t> pixels;
    std::vector<StoredSample> samples;
    double largest_error = 0;
};

/// The thinning of rows of a band: first of each row by itself, then, when the places of all
/// samples are known, into the result.
class RowThinner {
  public:
    RowThinner(const LayeredImage& image, int y0, const DeepMergeSettings& settings,
               LayeredImage& out)
        : image_(image),
          settings_(settings),
          out_(out),
          pixel_(image.pixelIndex(image.window.x0, y0)) {}

    /// Thins the pixels [begin, end) of `out`, and sets offsets[p + 1] to the number of samples of
    /// pixel p.
    ThinRow thin(std::size_t begin, std::size_t end) const;
    /// Stores the samples of the pixels [begin, end), when `offsets` is complete.
    void store(const ThinRow& row, std::size_t begin, std::size_t end) const;

  private:
    std::size_t sourceOf(std::size_t pixel) const { return image_.offsets[pixel_ + pixel]; }
    Glance look(const DeepSamples& samples) const;
    void store(const StoredSample& sample, std::size_t target) const;

    const LayeredImage& image_;
    const DeepMergeSettings& settings_;
    LayeredImage& out_;
    std::size_t pixel_;  ///< index of the first pixel in the band
};

Glance RowThinner::look(const DeepSamples& samples) const {
    if (!samples.back.empty()) return {samples.z.size(), true};
    const auto error = static_cast<float>(2 * settings_.error);
    return samples.tinted ? glance<true>(samples, error) : glance<false>(samples, error);
}

ThinRow RowThinner::thin(std::size_t begin, std::size_t end) const {
    PixelThinner thinner(image_, settings_);
    ThinRow row;
    DeepFloats floats(image_);
    floats.convert(sourceOf(begin), sourceOf(end));
    for (std::size_t p = begin; p < end; ++p) {
        const std::size_t source = sourceOf(p);
        if (source == sourceOf(p + 1)) continue;
        const Glance seen = look(floats.samples(source, sourceOf(p + 1)));
        out_.offsets[p + 1] = static_cast<std::uint32_t>(seen.visible);
        if (!seen.may_merge || !thinner.thin(floats.samples(source, source + seen.visible)))
            continue;
        const double error = thinner.error();
        if (!(error <= settings_.error)) continue;
        row.largest_error = std::max(row.largest_error, error);
        row.pixels.push_back(p);
        out_.offsets[p + 1] = static_cast<std::uint32_t>(thinner.samples().size());
        for (const ThinSample& sample : thinner.samples())
            row.samples.emplace_back(sample);
    }
    return row;
}

void RowThinner::store(const ThinRow& row, std::size_t begin, std::size_t end) const {
    std::size_t next = 0, sample = 0;             // in `row`
    std::size_t source = 0, target = 0, run = 0;  // fragments that are copied together
    const auto flush = [&] {
        copyFragments(image_, source, out_, target, run);
        run = 0;
    };
    for (std::size_t p = begin; p < end; ++p) {
        const std::size_t count = out_.count(p);
        if (next < row.pixels.size() && row.pixels[next] == p) {
            flush();
            ++next;
            for (std::size_t i = 0; i < count; ++i)
                store(row.samples[sample++], out_.offsets[p] + i);
            continue;
        }
        if (source + run != sourceOf(p)) flush();
        if (run == 0) {
            source = sourceOf(p);
            target = out_.offsets[p];
        }
        run += count;
    }
    flush();
}

void RowThinner::store(const StoredSample& sample, std::size_t target) const {
    copyFragments(image_, sample.sample, out_, target, 1);
    if (sample.whole) return;
    out_.z[target] = sample.front;
    for (FragmentArray& array : out_.extra) {
        for (std::size_t c = 0; c < array.components(); ++c)
            if (array.channels[c] == "ZBack" && array.type == PixelType::kFloat)
                array.as<float>()[target * array.components() + c] = sample.back;
    }
    TintedColor color{};
    std::ranges::copy(sample.color, color.begin());
    std::ranges::copy(sample.opacity, color.begin() + 4);
    color[3] = meanOpacity(color[4], color[5], color[6]);
    storeColor(color, out_.color, target);
}

}  // namespace

void thinDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                     LayeredImage& out, DeepThinning& sum) {
    out.window = {image.window.x0, y0, image.window.x1, y1};
    const auto width = static_cast<std::size_t>(image.window.width());
    const auto height = static_cast<std::size_t>(y1 - y0);
    out.offsets.assign(width * height + 1, 0);
    const RowThinner rows(image, y0, settings, out);
    std::vector<ThinRow> thinned(height);
    parallelFor(height,
                [&](std::size_t row) { thinned[row] = rows.thin(row * width, (row + 1) * width); });
    for (std::size_t p = 1; p < out.offsets.size(); ++p)
        out.offsets[p] += out.offsets[p - 1];
    resizeFragments(image, out.offsets.back(), out);
    parallelFor(height,
                [&](std::size_t row) { rows.store(thinned[row], row * width, (row + 1) * width); });
    const std::size_t first = image.pixelIndex(image.window.x0, y0);
    sum.before += image.offsets[first + width * height] - image.offsets[first];
    sum.after += out.offsets.back();
    for (const ThinRow& row : thinned)
        sum.largest_error = std::max(sum.largest_error, row.largest_error);
}

}  // namespace peeler
