// SPDX-License-Identifier: Apache-2.0
// Lenses whose radius in the picture is a function of the angle from the axis: FOV and F-Theta.
#include <algorithm>

#include <peeler/error.h>
#include "core/lens/distorted_shape.h"
#include "core/lens/polynomial.h"

namespace peeler {
namespace {

/// The distortion of Devernay, Faugeras, Straight Lines Have to Be Straight, 2001, section 2.2:
/// distorted radius = atan(2 r tan(ω/2)) / ω.
class FovDistortion {
  public:
    explicit FovDistortion(double omega) : omega_(omega), factor_(2 * portableTan(omega / 2)) {}

    std::optional<glm::dvec2> distorted(const glm::dvec2& point) const {
        const double r = std::sqrt(glm::dot(point, point));
        if (r == 0) return point;
        return point * (portableAtan2(r * factor_, 1) / (omega_ * r));
    }
    std::optional<PlaneValue> undistorted(const glm::dvec2& point) const {
        const double distorted = std::sqrt(glm::dot(point, point)), angle = distorted * omega_;
        if (!(angle < std::numbers::pi / 2)) return {};
        const double tan = portableTan(angle), r = tan / factor_;
        if (!(r < PerspectivePlane::kReach)) return {};
        return scaledRadially(point, distorted, r, (1 + tan * tan) * omega_ / factor_);
    }

  private:
    double omega_, factor_;
};

/// The polynomial between the angle from the axis and the radius in pixels of NVIDIA's F-Theta
/// model, and a linear mapping of the picture: (c x + d y, e x + y). The polynomial has either
/// direction; its inverse is exact up to the first extremum. The formulas are those of
/// FThetaCameraModel in https://github.com/nerfstudio-project/gsplat and of f_theta_undistortion in
/// https://github.com/NVlabs/instant-ngp (include/neural-graphics-primitives/common_device.cuh).
class FthetaDistortion {
  public:
    FthetaDistortion(Polynomial polynomial, bool from_radius, const glm::dmat2& linear, double most)
        : polynomial_(std::move(polynomial)),
          from_radius_(from_radius),
          linear_(linear),
          inverse_(glm::inverse(linear)),
          most_(std::min(most, std::numbers::pi)) {
        constexpr double kFarthest = 1e6;  // pixels
        const auto folds = signChanges(derivative(polynomial_), 0, from_radius ? kFarthest : most_);
        end_ = folds.empty() ? (from_radius ? kFarthest : most_) : folds[0];
    }

    std::optional<glm::dvec2> distorted(const glm::dvec2& point) const {
        const double angle = std::sqrt(glm::dot(point, point));
        if (!(angle <= most_)) return {};
        if (angle == 0) return point;
        const auto at = [&](double x) { return evaluate(polynomial_, x); };
        if (!from_radius_ && !(angle <= end_)) return {};
        const auto radius =
            from_radius_ ? increasingInverse(at, angle, end_) : std::optional(at(angle).first);
        if (!radius) return {};
        return linear_ * (point * (*radius / angle));
    }
    std::optional<PlaneValue> undistorted(const glm::dvec2& picture) const {
        const glm::dvec2 point = inverse_ * picture;
        const double radius = std::sqrt(glm::dot(point, point));
        const auto at = [&](double x) { return evaluate(polynomial_, x); };
        double angle = 0, slope = 0;
        if (from_radius_) {
            if (!(radius < end_)) return {};
            std::tie(angle, slope) = at(radius);
        } else {
            const auto found = increasingInverse(at, radius, end_);
            if (!found) return {};
            angle = *found;
            slope = 1 / at(angle).second;
        }
        if (!(angle <= most_)) return {};
        PlaneValue result = scaledRadially(point, radius, angle, slope);
        result.slopes = result.slopes * inverse_;
        return result;
    }

  private:
    Polynomial polynomial_;
    bool from_radius_;
    glm::dmat2 linear_, inverse_;
    double most_, end_;  ///< the largest angle; the end of the polynomial's domain
};

std::unique_ptr<const LensShape> fthetaOf(std::span<const double> c, bool from_radius) {
    constexpr std::size_t kTerms = 6, kLinear = 9, kAngle = 10;
    Polynomial polynomial(c.begin(), c.begin() + static_cast<long>(std::min(c.size(), kTerms)));
    if (polynomial[0] != 0 || !(polynomial[1] > 0))
        throw Error(ErrorKind::kUsage,
                    "an F-Theta polynomial must be 0 at the centre and grow from there", "p0, p1",
                    "give p0 = 0 and p1 above 0");
    glm::dmat2 linear(1);
    if (c.size() >= kLinear) linear = {{c[6], c[8]}, {c[7], 1}};
    if (!(glm::determinant(linear) > 0))
        throw Error(ErrorKind::kUsage, "the linear terms mirror or flatten the picture", "c, d, e",
                    "give 1, 0, 0 for none");
    const double most = c.size() >= kAngle ? c[kAngle - 1] : std::numbers::pi;
    if (!(most > 0))
        throw Error(ErrorKind::kUsage, "the largest angle must be above 0", "max angle",
                    "give radians from the axis");
    return std::make_unique<DistortedShape<EquidistantPlane, FthetaDistortion>>(
        FthetaDistortion(std::move(polynomial), from_radius, linear, most));
}

}  // namespace

std::unique_ptr<const LensShape> fovShape(std::span<const double> c, const Size& size) {
    const double omega = c[0];
    if (omega == 0) return pinholeShape(c, size);
    if (!(omega > 0 && omega < std::numbers::pi))
        throw Error(ErrorKind::kUsage, "the field of view of a FOV lens must lie between 0 and pi",
                    "omega", "give radians");
    return std::make_unique<DistortedShape<PerspectivePlane, FovDistortion>>(FovDistortion(omega));
}

std::unique_ptr<const LensShape> fthetaShape(std::span<const double> c, const Size&) {
    return fthetaOf(c, true);
}

std::unique_ptr<const LensShape> fthetaForwardShape(std::span<const double> c, const Size&) {
    return fthetaOf(c, false);
}

}  // namespace peeler
