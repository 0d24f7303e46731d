// SPDX-License-Identifier: Apache-2.0
// Conversion between calibrated intrinsics and crops of a larger centred picture.
#include "core/scene/intrinsics.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include <peeler/error.h>
#include "core/scene/camera_choice.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

/// The position of a picture, along one dimension, in a larger picture whose centre is on the
/// optical axis.
struct OffCentre {
    /// Size of the larger picture, and index of the picture's first pixel in it.
    int whole = 0, first = 0;
    double sample = 0;  ///< sample position in each pixel
    bool operator==(const OffCentre&) const = default;
};

/// Returns the placement of a picture with `pixels` pixels whose axis is `centre` pixels from the
/// centre of the first pixel; nullopt if the larger picture would exceed kMostPictureSide.
std::optional<OffCentre> offCentre(int pixels, double centre) {
    const double corner = centre + 0.5;  // measured from the corner of the first pixel
    const double whole = std::ceil(2 * std::max(corner, pixels - corner));
    if (!(whole <= kMostPictureSide)) return std::nullopt;
    const double before = whole / 2 - corner;
    const double first = std::floor(before + 0.5);
    return OffCentre{static_cast<int>(whole), static_cast<int>(first), 0.5 + (before - first)};
}

OffCentre offCentreOrFail(int pixels, double centre) {
    if (const auto found = offCentre(pixels, centre)) return *found;
    throw Error(ErrorKind::kUsage, "the principal point is too far outside the picture", "cx, cy",
                "give them in pixels from the centre of the upper left pixel");
}

/// Rounds a number to this many significant decimal digits.
double rounded(double value, int digits) {
    std::array<char, 32> text;
    char* const end = text.data() + text.size();
    const auto written =
        std::to_chars(text.data(), end, value, std::chars_format::scientific, digits - 1);
    double result = value;
    std::from_chars(text.data(), written.ptr, result);
    return result;
}

/// Returns the number with the fewest digits that equals `value` up to rounding and satisfies
/// fits(); nullopt if there is no such number.
template <class Fits>
std::optional<double> simplest(double value, const Fits& fits) {
    for (int digits = 1; digits < std::numeric_limits<double>::max_digits10; ++digits)
        if (const double candidate = rounded(value, digits); fits(candidate)) return candidate;
    constexpr int kFarthest =
        4;  // in units in the last place; more than the error of two divisions
    double below = value, above = value;
    for (int step = 0; step <= kFarthest; ++step) {
        if (fits(below)) return below;
        if (fits(above)) return above;
        below = std::nextafter(below, -std::numeric_limits<double>::infinity());
        above = std::nextafter(above, std::numeric_limits<double>::infinity());
    }
    return std::nullopt;
}

/// Returns the focal length with which a picture of `whole` pixels has this half extent at distance
/// 1.
double focalLengthOf(int whole, double half) {
    const double value = whole / (2 * half);
    if (const auto found = simplest(value, [&](double f) { return whole / (2 * f) == half; }))
        return *found;
    // No focal length gives exactly `half`. Uses the nearest half extent that a focal length gives,
    // so that further conversions change nothing.
    const double nearest = whole / (2 * value);
    return nearest == half ? value : focalLengthOf(whole, nearest);
}

/// Returns the position of the axis in a crop of `pixels` pixels.
double centreOf(int pixels, const OffCentre& side) {
    const double before = side.first + (side.sample - 0.5);
    const double value = (side.whole / 2.0 - before) - 0.5;
    const auto fits = [&](double centre) { return offCentre(pixels, centre) == side; };
    if (const auto found = simplest(value, fits)) return *found;
    // No position gives exactly this crop. Uses the crop that offCentre() makes for `value`, and
    // finds a position for that crop.
    const auto smaller = offCentre(pixels, value);
    return !smaller || *smaller == side ? value : centreOf(pixels, *smaller);
}

/// The focal length and the principal point along one dimension.
struct SideLens {
    double focal_length, centre;
};
SideLens lensOf(int pixels, const OffCentre& side, double half) {
    const double centre = centreOf(pixels, side);
    const auto made = offCentre(pixels, centre);
    if (!made || made->whole == side.whole) return {focalLengthOf(side.whole, half), centre};
    const double focal_length = side.whole / (2 * half);
    return {focalLengthOf(made->whole, made->whole / (2 * focal_length)), centre};
}

}  // namespace

void setIntrinsics(View& view, const Intrinsics& camera) {
    const bool usable = camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) &&
                        std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                        std::isfinite(camera.cy);
    if (!usable || !view.projection.perspective) {
        throw Error(ErrorKind::kUsage,
                    usable ? "an orthographic camera has no focal lengths"
                           : "focal lengths must be positive and all numbers finite",
                    "fx, fy, cx, cy");
    }
    const OffCentre x = offCentreOrFail(view.width, camera.cx),
                    y = offCentreOrFail(view.height, camera.cy);
    view.crop = {x.first, y.first, x.first + view.width, y.first + view.height};
    view.width = x.whole;
    view.height = y.whole;
    view.sample = {x.sample, y.sample};
    view.projection.half_width = x.whole / (2 * camera.fx);
    view.projection.half_height = y.whole / (2 * camera.fy);
    checkPixels({view.width, view.height});
}

void setLens(View& view, const LensCamera& camera) {
    if (!view.projection.perspective)
        throw Error(ErrorKind::kUsage, "an orthographic camera has no lens", camera.lens.model);
    view.projection.near = 0;
    view.projection.far = std::numeric_limits<double>::infinity();
    view.rays = lensPicture(camera, {view.width, view.height});
}

}  // namespace peeler

namespace peeler::inline v0 {

Intrinsics intrinsicsOf(const View& view) {
    if (!view.projection.perspective)
        throw Error(ErrorKind::kUsage, "an orthographic camera has no focal lengths",
                    view.camera_name);
    if (const LensCamera* camera = lensCameraOf(view)) {
        Intrinsics intrinsics = camera->intrinsics;
        intrinsics.cx -= view.crop.x0;
        intrinsics.cy -= view.crop.y0;
        return intrinsics;
    }
    const Window& crop = view.crop;
    const SideLens x = lensOf(crop.width(), {view.width, crop.x0, view.sample.x},
                              view.projection.half_width),
                   y = lensOf(crop.height(), {view.height, crop.y0, view.sample.y},
                              view.projection.half_height);
    return {x.focal_length, y.focal_length, x.centre, y.centre};
}

}  // namespace peeler::inline v0
