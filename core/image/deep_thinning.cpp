// SPDX-License-Identifier: Apache-2.0
#include "core/image/deep_thinning.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <bit>
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
#include "core/base/lanes.h"
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

/// The greatest of all lanes.
float greatestOf(const FourFloats& lanes) {
    const FourFloats pairs = most(lanes, __builtin_shufflevector(lanes, lanes, 2, 3, 0, 1));
    return std::max(pairs[0], pairs[1]);
}

/// Finds the pixels that need no thinning, or only lose hidden samples. `error` is twice the bound.
/// Values without meaning (DeepCurve::read) keep all samples. Single precision misses only pairs
/// that differ by just the bound, at half the time.
Glance glance(const DeepSamples& samples, float error) {
    const std::span<const float> z = samples.z;
    FourFloats sum{}, largest{}, rest{1, 1, 1, 1};
    float nearest = std::numeric_limits<float>::infinity();
    MeaningCheck meaning;
    Glance seen{z.size(), false};
    bool coincident = false, opaque = false;
    for (std::size_t i = 0; i < z.size(); ++i) {
        const SampleLanes sample = samples.lanes(i);
        meaning.add(sample);
        const FourFloats gain = rest * sample.color, covered = rest * sample.opacity;
        sum += gain;
        largest = most(most(sum, -sum), largest);
        rest *= 1 - sample.opacity;
        if (opaque) continue;
        coincident = coincident || (i > 0 && z[i] == z[i - 1]);
        if (greatestOf(covered) <= error)
            nearest = std::min(nearest, greatestOf(most(gain, -gain)));
        opaque = greatestOf(rest) == 0;
        if (opaque) seen.visible = i + 1;
    }
    if (!meaning.holds()) return {z.size(), false};
    seen.may_merge = coincident || nearest <= error * std::max(1.0F, greatestOf(largest));
    return seen;
}

StateLanes lanesOf(const DeepState& state) {
    return std::bit_cast<StateLanes>(state);
}

/// Whether `a` exceeds `b` in no component by more than `bounds`.
bool isWithin(const StateLanes& a, const StateLanes& b, const StateLanes& bounds) {
    const auto good =
        (a[0] - b[0] <= bounds[0]) & (a[1] - b[1] <= bounds[1]) & (a[2] - b[2] <= bounds[2]);
    return (good[0] & good[1]) != 0;
}

/// The least and the greatest state of a run.
struct StateRange {
    StateLanes low, high;

    explicit StateRange(const DeepState& state) : low(lanesOf(state)), high(low) {}
    void add(const DeepState& state) {
        const StateLanes lanes = lanesOf(state);
        for (std::size_t i = 0; i < lanes.size(); ++i) {
            low[i] = least(low[i], lanes[i]);
            high[i] = most(high[i], lanes[i]);
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

/// A sample of the result on the walk along the original. Steps are made in place: their values are
/// not copied while the processor still stores them.
struct Step {
    ThinSample sample;
    DeepState state{};    ///< behind the sample
    std::size_t end = 0;  ///< number of pieces that the steps so far account for
};

/// The thinning of one pixel after another. Keeps its storage.
class PixelThinner {
  public:
    PixelThinner(const LayeredImage& image, const DeepMergeSettings& settings);

    /// Thins a pixel. Returns false if its samples must stay as they are.
    bool thin(const DeepSamples& samples);
    std::span<const Step> steps() const { return std::span(steps_).first(count_); }
    /// Returns the largest error of the samples, whose values are those to be stored.
    double error();

  private:
    void setBounds(std::size_t fragments);
    bool walk();
    bool walkObjects();
    bool isNear(const DeepState& a, const DeepState& b) const;
    bool fits(const StateRange& run, std::size_t end) const;
    bool isPinned(std::size_t c, std::size_t end) const { return opaque_[c] && end == pieces_; }
    std::size_t hold(std::size_t piece) const;
    bool point(std::size_t piece, Step& step) const;
    bool settle(const StateRange& run, Step& step) const;
    std::optional<Step> volume(std::size_t piece) const;
    std::optional<Step> fitVolume(std::size_t piece, std::size_t last) const;
    std::optional<double> fitOpacity(std::size_t piece, std::size_t last, std::size_t c) const;
    std::optional<double> fitColor(const ThinSample& sample, std::size_t piece, std::size_t last,
                                   std::size_t c) const;
    bool holdsInside(const ThinSample& sample, std::size_t piece, std::size_t last) const;
    bool isSameObject(std::uint32_t a, std::uint32_t b) const;
    void objectStep(std::size_t piece, Step& step) const;
    double opacityNear(double opacity, bool pinned) const;
    bool copyOf(std::size_t piece, Step& step) const;

    const LayeredImage& image_;
    const DeepMergeSettings& settings_;
    FragmentChannel objects_, materials_;
    bool can_store_volumes_ = false;
    DeepCurve curve_, stored_;
    std::vector<Step> steps_;  ///< the first `count_` are valid
    std::size_t count_ = 0;
    DeepState bounds_{};            ///< the largest error of each component
    DeepState widths_{};            ///< twice the bounds
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
    count_ = 0;
    state_ = kDeepStart;
    if (count < 2 || !curve_.read(samples)) return false;
    if (curve_.hasVolumes() && (!can_store_volumes_ || settings_.keep_ids)) return false;
    if (!settings_.keep_ids) curve_.mergePoints();
    setBounds(count);
    steps_.resize(std::max(steps_.size(), curve_.pieces().size()));
    const bool done = settings_.keep_ids ? walkObjects() : walk();
    return done && count_ < count;
}

void PixelThinner::setBounds(std::size_t fragments) {
    const double error =
        std::max(settings_.error / 2, settings_.error - 0x1p-23 * static_cast<double>(fragments));
    const double scale = curve_.colorScale();
    bounds_ = {error * scale, error * scale, error * scale, error, error, error};
    std::ranges::transform(bounds_, widths_.begin(), [](double bound) { return 2 * bound; });
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
    const StateLanes x = lanesOf(a), y = lanesOf(b), bounds = lanesOf(bounds_);
    return isWithin(x, y, bounds) && isWithin(y, x, bounds);
}

/// Whether one state can stand for a run that ends behind piece `end` − 1.
bool PixelThinner::fits(const StateRange& run, std::size_t end) const {
    if (!isWithin(run.high, run.low, lanesOf(widths_))) return false;
    const auto greatest = std::bit_cast<DeepState>(run.high);
    for (std::size_t c = 0; c < 3; ++c)
        if (isPinned(c, end) && greatest[3 + c] > bounds_[3 + c]) return false;
    return true;
}

bool PixelThinner::walk() {
    const bool volumes = curve_.hasVolumes();
    for (std::size_t piece = hold(0); piece < pieces_; piece = hold(piece)) {
        Step& step = steps_[count_++];
        bool found = point(piece, step);
        if (volumes) {
            const std::optional<Step> other = volume(piece);
            if (other && (!found || other->end > step.end)) step = *other;
            found = found || other;
        }
        if (!found) return false;
        state_ = step.state;
        piece = step.end;
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

/// Makes a step of the original sample if it leads from the present state exactly to the next.
bool PixelThinner::copyOf(std::size_t piece, Step& step) const {
    if (!curve_.pieces()[piece].whole || state_ != curve_.states()[piece]) return false;
    step = {curve_.pieces()[piece], curve_.states()[piece + 1], piece + 1};
    return true;
}

/// Makes a point at the front of a piece, for the farthest run that it can begin.
bool PixelThinner::point(std::size_t piece, Step& step) const {
    const DeepPiece& at = curve_.pieces()[piece];
    const std::span<const DeepState> states = curve_.states();
    const std::size_t first = at.volume() ? piece : piece + 1;
    std::size_t end = first;
    StateRange run(states[first]);
    for (StateRange next = run; end < pieces_; ++end, run = next) {
        next.add(states[end + 1]);
        if (!fits(next, end + 1)) break;
    }
    if (end == piece + 1 && !at.volume() && copyOf(piece, step)) return true;
    step.sample.front = step.sample.back = at.front;
    step.sample.sample = at.sample;
    step.sample.whole = false;
    for (; end > piece; --end) {
        step.end = end;
        if (settle(run, step)) return true;
        run = StateRange(states[first]);
        for (std::size_t i = first + 1; i < end; ++i)
            run.add(states[i]);
    }
    return false;
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
    const auto least = std::bit_cast<DeepState>(run.low);
    const auto greatest = std::bit_cast<DeepState>(run.high);
    bool good = true;
    for (std::size_t i = bounds_.size(); i-- > 0;) {
        const std::size_t c = i % 3;
        const double front = state_[3 + c];
        const double middle = (least[i] + greatest[i]) / 2;
        if (i >= 3) {
            const bool pinned = greatest[i] == 0 || isPinned(c, step.end);
            step.sample.opacity[c] = opacityNear(front > 0 ? 1 - middle / front : 1, pinned);
            step.state[i] = front * (1 - step.sample.opacity[c]);
        } else {
            double color = front > 0 ? rounded((middle - state_[i]) / front, image_.color.type) : 0;
            if (no_negative_) color = std::max(color, 0.0);
            step.sample.color[c] = color;
            step.state[i] = state_[i] + front * color;
        }
        good = good && step.state[i] >= greatest[i] - bounds_[i] &&
               step.state[i] <= least[i] + bounds_[i];
    }
    return good;
}

/// Returns the volume from the front of a piece that reaches farthest.
std::optional<Step> PixelThinner::volume(std::size_t piece) const {
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
std::optional<Step> PixelThinner::fitVolume(std::size_t piece, std::size_t last) const {
    const std::span<const DeepPiece> pieces = curve_.pieces();
    Step step;
    if (last == piece && copyOf(piece, step)) return step;
    step = {{pieces[piece].front, pieces[last].back, {}, {}, pieces[piece].sample, false},
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

/// Places one sample for the longest run of samples of one object. In front of it the original's
/// states must be near the present one, behind it near the run's last.
void PixelThinner::objectStep(std::size_t piece, Step& step) const {
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
    step = {{pieces[at].front, pieces[at].front, {}, {}, pieces[at].sample, false}, state_, end};
}

bool PixelThinner::walkObjects() {
    for (std::size_t piece = 0; piece < pieces_;) {
        Step& step = steps_[count_++];
        objectStep(piece, step);
        if (!(step.end == piece + 1 && copyOf(piece, step)) &&
            !settle(StateRange(curve_.states()[step.end]), step))
            return false;
        state_ = step.state;
        piece = step.end;
    }
    return true;
}

double PixelThinner::error() {
    stored_.assign(steps(), [](const Step& step) -> const ThinSample& { return step.sample; });
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

/// What a thread keeps from row to row.
struct ThinScratch {
    ThinScratch(const LayeredImage& image, const DeepMergeSettings& settings)
        : thinner(image, settings), floats(image) {}
    PixelThinner thinner;
    DeepFloats floats;
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
    void thin(std::size_t begin, std::size_t end, ThinScratch& scratch, ThinRow& row) const;
    std::size_t sourceOf(std::size_t pixel) const { return image_.offsets[pixel_ + pixel]; }
    Glance look(const DeepSamples& samples) const;
    void setValues(const StoredSample& sample, std::size_t target) const;

    const LayeredImage& image_;
    const DeepMergeSettings& settings_;
    LayeredImage& out_;
    std::size_t pixel_;  ///< index of the first pixel in the band
    mutable ObjectPool<std::optional<ThinScratch>> scratch_;
};

Glance RowThinner::look(const DeepSamples& samples) const {
    if (!samples.back.empty()) return {samples.z.size(), true};
    const auto error = static_cast<float>(2 * settings_.error);
    return glance(samples, error);
}

ThinRow RowThinner::thin(std::size_t begin, std::size_t end) const {
    ThinRow row;
    scratch_.with([&](std::optional<ThinScratch>& scratch) {
        if (!scratch) scratch.emplace(image_, settings_);
        thin(begin, end, *scratch, row);
    });
    return row;
}

void RowThinner::thin(std::size_t begin, std::size_t end, ThinScratch& scratch,
                      ThinRow& row) const {
    auto& [thinner, floats] = scratch;
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
        out_.offsets[p + 1] = static_cast<std::uint32_t>(thinner.steps().size());
        for (const Step& step : thinner.steps())
            row.samples.emplace_back(step.sample);
    }
}

void RowThinner::store(const ThinRow& row, std::size_t begin, std::size_t end) const {
    std::size_t source = 0, target = out_.offsets[begin], run = 0;  // copied together
    const auto copy = [&](std::size_t from, std::size_t count) {
        if (source + run != from) {
            copyFragments(image_, source, out_, target, run);
            source = from;
            target += run;
            run = 0;
        }
        run += count;
    };
    auto pixel = row.pixels.begin();
    auto sample = row.samples.begin();
    for (std::size_t p = begin; p < end; ++p) {
        const std::size_t count = out_.count(p);
        if (pixel == row.pixels.end() || *pixel != p) {
            copy(sourceOf(p), count);
            continue;
        }
        ++pixel;
        for (std::size_t i = 0; i < count; ++i)
            copy((sample++)->sample, 1);
    }
    copyFragments(image_, source, out_, target, run);
    sample = row.samples.begin();
    for (const std::size_t p : row.pixels)
        for (std::size_t f = out_.offsets[p]; f < out_.offsets[p + 1]; ++f, ++sample)
            if (!sample->whole) setValues(*sample, f);
}

/// Gives a copy of the nearest fragment the values of a sample.
void RowThinner::setValues(const StoredSample& sample, std::size_t target) const {
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
