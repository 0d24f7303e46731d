// SPDX-License-Identifier: Apache-2.0
// Lenses with a radial polynomial, tangential and thin-prism distortion, on the plane of a pinhole
// or of the equidistant projection.
//
// OpenCV: https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html ("Detailed Description") and
// https://docs.opencv.org/4.x/db/d58/group__calib3d__fisheye.html
// COLMAP: src/colmap/sensor/models.h. Aria (FISHEYE624, RAD_TAN_THIN_PRISM_FISHEYE):
// https://facebookresearch.github.io/projectaria_tools/docs/tech_insights/camera_intrinsic_models
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include <peeler/error.h>
#include "core/lens/distorted_shape.h"
#include "core/lens/polynomial.h"

namespace peeler {
namespace {

struct DistortionTerms {
    /// The radial factor is a quotient of polynomials in q = r²: (1 + k1 q + …) / (1 + k4 q + …).
    Polynomial numerator{1}, denominator{1};
    double p1 = 0, p2 = 0;          ///< tangential
    std::array<double, 4> prism{};  ///< s1, s2, s3, s4
    bool after_radial = false;      ///< whether the other terms take radially distorted points
};

/// The distortion of a plane. Its domain is the part around the centre where the mapping does not
/// fold back, which is where it has an inverse.
class PlaneDistortion {
  public:
    /// `reach` is the largest radius of the plane.
    PlaneDistortion(DistortionTerms terms, double reach);

    std::optional<glm::dvec2> distorted(const glm::dvec2& point) const;
    std::optional<PlaneValue> undistorted(const glm::dvec2& point) const;

  private:
    std::pair<double, double> radius(double r) const;
    PlaneValue radial(const glm::dvec2& point) const;
    PlaneValue others(const glm::dvec2& point) const;
    PlaneValue whole(const glm::dvec2& point) const;
    bool inside(const glm::dvec2& point, const glm::dmat2& slopes) const;
    std::optional<PlaneValue> newton(const glm::dvec2& point) const;
    std::optional<PlaneValue> newtonFrom(glm::dvec2 at, const glm::dvec2& point) const;

    DistortionTerms terms_;
    bool only_radial_;
    double end_;        ///< the radius at which the radial distortion folds back, or the reach
    double outermost_;  ///< a radius outside the domain and inside any other region without folds
};

/// Returns the squared radii at which the radially distorted radius changes between growing and
/// shrinking, or is infinite.
std::vector<double> foldsOf(const DistortionTerms& terms, double most) {
    // d(r N/D)/dr · D² = N D + 2 q (N' D − N D')
    const Polynomial &n = terms.numerator, &d = terms.denominator;
    const Polynomial turning =
        sum(product(derivative(n).empty() ? Polynomial{0} : derivative(n), d),
            product(n, derivative(d).empty() ? Polynomial{0} : derivative(d)), -1);
    const Polynomial slope = sum(product(n, d), product(turning, Polynomial{0, 2}));
    std::vector<double> folds = signChanges(slope, 0, most);
    for (const double pole : signChanges(d, 0, most))
        folds.push_back(pole);
    std::ranges::sort(folds);
    return folds;
}

PlaneDistortion::PlaneDistortion(DistortionTerms terms, double reach) : terms_(std::move(terms)) {
    only_radial_ = terms_.p1 == 0 && terms_.p2 == 0 &&
                   std::ranges::all_of(terms_.prism, [](double s) { return s == 0; });
    const std::vector<double> folds = foldsOf(terms_, reach * reach);
    end_ = folds.empty() ? reach : std::sqrt(folds[0]);
    // Beyond the first fold, the determinant of the derivatives is below 0 until the next fold, or
    // until the radius is 0 again.
    double next = folds.size() < 2 ? reach : std::sqrt(folds[1]);
    for (const double zero : signChanges(terms_.numerator, 0, reach * reach))
        next = std::min(next, std::sqrt(zero));
    outermost_ = end_ + (std::max(next, end_) - end_) / 2;
}

/// Returns the radially distorted radius and its derivative.
std::pair<double, double> PlaneDistortion::radius(double r) const {
    const double q = r * r;
    const auto [n, n_slope] = evaluate(terms_.numerator, q);
    if (terms_.denominator.size() == 1) return {r * n, n + 2 * q * n_slope};
    const auto [d, d_slope] = evaluate(terms_.denominator, q);
    const double factor = n / d;
    return {r * factor, factor + 2 * q * (n_slope - factor * d_slope) / d};
}

PlaneValue PlaneDistortion::radial(const glm::dvec2& point) const {
    const double r = std::sqrt(glm::dot(point, point));
    const auto [distorted, slope] = radius(r);
    return scaledRadially(point, r, distorted, slope);
}

PlaneValue PlaneDistortion::others(const glm::dvec2& point) const {
    const double x = point.x, y = point.y, q = x * x + y * y;
    const auto [s1, s2, s3, s4] = terms_.prism;
    const double p1 = terms_.p1, p2 = terms_.p2;
    const double prism_x = 2 * (s1 + 2 * s2 * q), prism_y = 2 * (s3 + 2 * s4 * q);  // by q, twice
    return {{2 * p1 * x * y + p2 * (q + 2 * x * x) + q * (s1 + s2 * q),
             2 * p2 * x * y + p1 * (q + 2 * y * y) + q * (s3 + s4 * q)},
            {{2 * p1 * y + 6 * p2 * x + x * prism_x, 2 * p2 * y + 2 * p1 * x + x * prism_y},
             {2 * p1 * x + 2 * p2 * y + y * prism_x, 2 * p2 * x + 6 * p1 * y + y * prism_y}}};
}

PlaneValue PlaneDistortion::whole(const glm::dvec2& point) const {
    const PlaneValue first = radial(point);
    if (only_radial_) return first;
    if (terms_.after_radial) {
        const PlaneValue second = others(first.value);
        return {first.value + second.value, (glm::dmat2(1) + second.slopes) * first.slopes};
    }
    const PlaneValue second = others(point);
    return {first.value + second.value, first.slopes + second.slopes};
}

/// Whether a point belongs to the domain.
bool PlaneDistortion::inside(const glm::dvec2& point, const glm::dmat2& slopes) const {
    const double q = glm::dot(point, point);
    if (only_radial_) return q < end_ * end_;
    return q < outermost_ * outermost_ && glm::determinant(slopes) > 0;
}

std::optional<glm::dvec2> PlaneDistortion::distorted(const glm::dvec2& point) const {
    const PlaneValue result = whole(point);
    if (!inside(point, result.slopes)) return {};
    if (only_radial_) return result.value;
    // Strong tangential terms may map two points of the domain to one. Only one is its inverse.
    constexpr double kSame = 1e-6;
    const auto inverse = newton(result.value);
    if (!inverse || glm::length(inverse->value - point) > kSame * (1 + glm::length(point)))
        return {};
    return result.value;
}

std::optional<PlaneValue> PlaneDistortion::undistorted(const glm::dvec2& point) const {
    if (!only_radial_) return newton(point);
    const double distorted = std::sqrt(glm::dot(point, point));
    if (terms_.numerator.size() == 1 && terms_.denominator.size() == 1)  // both are 1
        return distorted < end_ ? std::optional(PlaneValue{point}) : std::nullopt;
    const auto r = increasingInverse([&](double at) { return radius(at); }, distorted, end_);
    if (!r || !(*r < end_)) return {};
    return scaledRadially(point, distorted, *r, 1 / radius(*r).second);
}

/// Inverts the distortion by Newton's method in two dimensions, from the radial inverse or, if that
/// leads nowhere, from points nearer to the centre.
std::optional<PlaneValue> PlaneDistortion::newton(const glm::dvec2& point) const {
    const double distorted = std::sqrt(glm::dot(point, point));
    const auto r = increasingInverse([&](double at) { return radius(at); }, distorted, end_);
    constexpr double kInside = 0.9;
    const double start = std::min(r.value_or(end_), kInside * end_);
    const glm::dvec2 at = distorted > 0 ? point * (start / distorted) : glm::dvec2(0);
    for (const double scale : {1.0, 0.5, 0.0})
        if (const auto found = newtonFrom(at * scale, point)) return found;
    return {};
}

/// Shortens steps that leave the domain or lead away from the solution.
std::optional<PlaneValue> PlaneDistortion::newtonFrom(glm::dvec2 at,
                                                      const glm::dvec2& point) const {
    PlaneValue now = whole(at);
    if (!inside(at, now.slopes)) return {};
    double error = glm::length(now.value - point);
    constexpr int kMostSteps = 100, kMostHalvings = 40;
    for (int step = 0; step < kMostSteps && error > 0; ++step) {
        glm::dvec2 change = glm::inverse(now.slopes) * (point - now.value);
        bool nearer = false;
        for (int i = 0; i < kMostHalvings && !nearer; ++i, change *= 0.5) {
            const PlaneValue next = whole(at + change);
            const double left = glm::length(next.value - point);
            nearer = inside(at + change, next.slopes) && left < error;
            if (!nearer) continue;
            at += change;
            now = next;
            error = left;
        }
        if (!nearer) break;
    }
    constexpr double kSolved = 1e-13;
    if (!(error <= kSolved * (1 + glm::length(point)))) return {};
    return PlaneValue{at, glm::inverse(now.slopes)};
}

/// Returns coefficient i, or 0 if it is not given.
double given(std::span<const double> coefficients, std::size_t i) {
    return i < coefficients.size() ? coefficients[i] : 0;
}

/// Returns the polynomial without zeros at its end.
Polynomial trimmed(Polynomial polynomial) {
    while (polynomial.size() > 1 && polynomial.back() == 0)
        polynomial.pop_back();
    return polynomial;
}

template <class Plane>
std::unique_ptr<const LensShape> shapeOf(DistortionTerms terms) {
    terms.numerator = trimmed(std::move(terms.numerator));
    terms.denominator = trimmed(std::move(terms.denominator));
    return std::make_unique<DistortedShape<Plane, PlaneDistortion>>(
        PlaneDistortion(std::move(terms), Plane::kReach));
}

}  // namespace

std::unique_ptr<const LensShape> pinholeShape(std::span<const double>, const Size&) {
    return shapeOf<PerspectivePlane>({});
}

std::unique_ptr<const LensShape> opencvShape(std::span<const double> c, const Size&) {
    const auto k = [&](std::size_t i) { return given(c, i); };
    if (k(12) != 0 || k(13) != 0)
        throw Error(ErrorKind::kUsage, "a tilted sensor is not rendered", "tauX, tauY",
                    "undistort the pictures first");
    DistortionTerms terms;
    terms.numerator = {1, k(0), k(1), k(4)};
    terms.denominator = {1, k(5), k(6), k(7)};
    terms.p1 = k(2);
    terms.p2 = k(3);
    terms.prism = {k(8), k(9), k(10), k(11)};
    return shapeOf<PerspectivePlane>(terms);
}

std::unique_ptr<const LensShape> fisheyeShape(std::span<const double> c, const Size&) {
    DistortionTerms terms;
    terms.numerator = {1, given(c, 0), given(c, 1), given(c, 2), given(c, 3)};
    return shapeOf<EquidistantPlane>(terms);
}

std::unique_ptr<const LensShape> thinPrismFisheyeShape(std::span<const double> c, const Size&) {
    const auto k = [&](std::size_t i) { return given(c, i); };
    DistortionTerms terms;
    terms.numerator = {1, k(0), k(1), k(4), k(5)};
    terms.p1 = k(2);
    terms.p2 = k(3);
    terms.prism = {k(6), 0, k(7), 0};
    return shapeOf<EquidistantPlane>(terms);
}

std::unique_ptr<const LensShape> radTanThinPrismFisheyeShape(std::span<const double> c,
                                                             const Size&) {
    const auto k = [&](std::size_t i) { return given(c, i); };
    DistortionTerms terms;
    terms.numerator = {1, k(0), k(1), k(2), k(3), k(4), k(5)};
    terms.p1 = k(7);  // Aria's p0 is OpenCV's p2
    terms.p2 = k(6);
    terms.prism = {k(8), k(9), k(10), k(11)};
    terms.after_radial = true;
    return shapeOf<EquidistantPlane>(terms);
}

}  // namespace peeler
