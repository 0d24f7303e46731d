// SPDX-License-Identifier: Apache-2.0
// The difference of two pictures, by fragment and by pixel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>

namespace peeler {

/// Statistics of absolute differences. The difference of two equal infinities or of two NaNs is 0.
/// The difference of a NaN and a number is infinite.
struct DifferenceStatistics {
    std::uint64_t values = 0;
    double largest = 0, sum = 0, sum_of_squares = 0;
    /// The first pixel with the largest difference; −1 if all values are equal.
    int x = -1, y = -1;

    void add(double a, double b, int at_x, int at_y);
    /// Adds the statistics of later pixels.
    void merge(const DifferenceStatistics& later);

    double mean() const;
    double rmse() const;
    /// Returns the peak signal-to-noise ratio in decibels for a peak of 1; +inf if all values are
    /// equal.
    double psnr() const;
};

/// Differences of the fragments of one layer, or of all layers. The k-th fragments of a pixel in
/// both pictures are compared.
struct FragmentDifference {
    /// Fragments that are in both pictures, or only in one.
    std::uint64_t both = 0, only_a = 0, only_b = 0;
    DifferenceStatistics depth;  ///< differences of Z between fragments in both pictures
    /// Differences of the premultiplied components R, G, B and A. AR, AG and AB are included if one
    /// of the pictures has them. Each component is one value.
    DifferenceStatistics color;

    void merge(const FragmentDifference& later);
};

struct LayeredDifference {
    std::uint64_t pixels = 0;
    std::uint64_t count_pixels = 0;   ///< number of pixels in which the numbers of fragments differ
    std::uint32_t largest_count = 0;  ///< largest difference in a pixel's number of fragments
    FragmentDifference all;
    std::vector<FragmentDifference> layers;  ///< differences of each layer, front to back
    DifferenceStatistics composite;          ///< differences of the composites without background

    void merge(const LayeredDifference& later);
};

/// Adds the difference of two bands of equal width and height to `sum`. Pixel positions in `sum`
/// are those of `a`. If `largest` is not empty, it receives one value per pixel: the largest colour
/// difference or, if the bands have different numbers of fragments in the pixel, the negative of
/// the difference of these numbers. The result does not depend on the number of threads.
void addDifference(const LayeredImage& a, const LayeredImage& b, LayeredDifference& sum,
                   std::span<float> largest = {});

/// Adds the difference of two flat pictures of equal size to `sum`. If `largest` is not empty, it
/// receives the largest colour difference of each pixel.
void addDifference(const CompositeImage& a, const CompositeImage& b, DifferenceStatistics& sum,
                   std::span<float> largest = {});

}  // namespace peeler
