// SPDX-License-Identifier: Apache-2.0
#include "core/lens/lens.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <peeler/error.h>
#include "core/base/names.h"
#include "core/lens/lens_shape.h"
#include "core/lens/panoramas.h"

namespace peeler {
namespace {

template <std::size_t... Counts>
constexpr std::array<std::size_t, sizeof...(Counts)> kCounts{Counts...};

constexpr LensModel kLensModels[] = {
    {"pinhole", "no distortion", kCounts<0>, false, true, nullptr, pinholeShape},
    {"opencv", "k1,k2,p1,p2[,k3[,k4,k5,k6[,s1,s2,s3,s4]]], as OpenCV's distCoeffs",
     kCounts<4, 5, 8, 12, 14>, false, true, nullptr, opencvShape},
    {"opencv-fisheye", "k1,k2,k3,k4, as OpenCV's fisheye (Kannala-Brandt)", kCounts<4>, false,
     false, nullptr, fisheyeShape},
    {"simple-radial", "k1, as COLMAP", kCounts<1>, false, true, nullptr, opencvShape},
    {"radial", "k1,k2, as COLMAP", kCounts<2>, false, true, nullptr, opencvShape},
    {"full-opencv", "k1,k2,p1,p2,k3,k4,k5,k6, as COLMAP", kCounts<8>, false, true, nullptr,
     opencvShape},
    {"simple-fisheye", "no coefficients: equidistant, as COLMAP", kCounts<0>, false, false, nullptr,
     fisheyeShape},
    {"fisheye", "no coefficients: equidistant, as COLMAP", kCounts<0>, false, false, nullptr,
     fisheyeShape},
    {"simple-radial-fisheye", "k1, as COLMAP", kCounts<1>, false, false, nullptr, fisheyeShape},
    {"radial-fisheye", "k1,k2, as COLMAP", kCounts<2>, false, false, nullptr, fisheyeShape},
    {"thin-prism-fisheye", "k1,k2,p1,p2,k3,k4,sx1,sy1, as COLMAP", kCounts<8>, false, false,
     nullptr, thinPrismFisheyeShape},
    {"rad-tan-thin-prism-fisheye", "k1,...,k6,p1,p2,s1,s2,s3,s4, as COLMAP and Aria (FISHEYE624)",
     kCounts<12>, false, false, nullptr, radTanThinPrismFisheyeShape},
    {"fov", "omega (radians), as COLMAP", kCounts<1>, false, true, nullptr, fovShape},
    {"ftheta",
     "p0,p1,...,p5[,c,d,e[,max]], as NVIDIA: angle from the radius in pixels; linear terms; "
     "largest angle",
     kCounts<2, 3, 4, 5, 6, 9, 10>, true, false, nullptr, fthetaShape},
    {"ftheta-forward", "the same: radius in pixels from the angle", kCounts<2, 3, 4, 5, 6, 9, 10>,
     true, false, nullptr, fthetaForwardShape},
    {"equirectangular", "all directions, by longitude and latitude", kCounts<0>, false, false,
     equirectangularFilling, equirectangularShape},
    {"cube", "all directions, as six faces: right, left, up, down, front, back", kCounts<0>, false,
     false, cubeFilling, cubeShape},
};

/// Returns the numbers as "4, 5 or 8".
std::string countsText(std::span<const std::size_t> counts) {
    std::string text = std::to_string(counts[0]);
    for (std::size_t i = 1; i < counts.size(); ++i)
        text += (i + 1 == counts.size() ? " or " : ", ") + std::to_string(counts[i]);
    return text;
}

}  // namespace

std::span<const LensModel> lensModels() {
    return kLensModels;
}

const LensModel* findLensModel(std::string_view name) {
    std::string lower(name);
    for (char& c : lower)
        c = c == '_' ? '-' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (lower == "simple-pinhole") lower = "pinhole";
    if (lower == "fisheye624") lower = "rad-tan-thin-prism-fisheye";
    const auto* const row = std::ranges::find(kLensModels, lower, &LensModel::name);
    return row == std::end(kLensModels) ? nullptr : row;
}

const LensModel& lensModel(const Lens& lens) {
    const LensModel* const row = findLensModel(lens.model);
    if (row) return *row;
    std::vector<std::string_view> names;
    for (const LensModel& other : kLensModels)
        names.push_back(other.name);
    throw Error(ErrorKind::kUsage, "unknown lens model", lens.model,
                choiceHint(lens.model, "lenses", names));
}

bool isPinhole(const Lens& lens) {
    return lensModel(lens).perspective &&
           std::ranges::all_of(lens.coefficients, [](double k) { return k == 0; });
}

Lens makeLens(std::string_view model, std::vector<double> coefficients) {
    const LensModel& row = lensModel({std::string(model)});
    if (std::ranges::find(row.counts, coefficients.size()) == row.counts.end())
        throw Error(ErrorKind::kUsage,
                    "a lens " + std::string(row.name) + " takes " + countsText(row.counts) +
                        " coefficients, not " + std::to_string(coefficients.size()),
                    std::string(row.name), "give " + std::string(row.summary));
    if (!std::ranges::all_of(coefficients, [](double k) { return std::isfinite(k); }))
        throw Error(ErrorKind::kUsage, "the coefficients of a lens must be finite",
                    std::string(row.name));
    row.shape(coefficients, {});
    return {std::string(row.name), std::move(coefficients)};
}

}  // namespace peeler
