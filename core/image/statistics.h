// SPDX-License-Identifier: Apache-2.0
// Picture statistics: median depth, midpoints, world-space bounds, and checks of layers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Returns the median Z of the first fragments in the middle ninth of the picture, or in the whole
/// picture if the middle is empty; nullopt if the picture is empty. Scene units.
std::optional<double> medianDepth(const LayeredImage& image, const View& view);

/// Writes, for each pixel, the mean of the two smallest distinct Z (Woo, "The Shadow Depth Map
/// Revisited", Graphics Gems III, 1992), in scene units; +inf if the pixel has fewer than two
/// distinct Z. Two Z are distinct if they differ by more than the rounding of rasterised depths
/// (2^-18 of Z, or of the depth range of an orthographic view). So coincident surfaces with
/// different triangulations do not get a midpoint between them, which would lie on both. `out` has
/// one value per pixel of the window.
void midpoints(const LayeredImage& image, const Projection& projection, std::span<float> out);

/// The number, the bounding box and the mean of world-space points. Points are accumulated in
/// double precision in order of arrival, so the results do not depend on how a picture is divided
/// into bands.
struct PointStatistics {
    std::uint64_t points = 0;
    glm::dvec3 least{std::numeric_limits<double>::infinity()};
    glm::dvec3 largest{-std::numeric_limits<double>::infinity()};
    glm::dvec3 sum{0};

    void add(const glm::dvec3& point);
    bool empty() const { return points == 0; }

    /// Return the box and the mean for output. Coordinates below 1e-9 of the box's diagonal are
    /// rounding errors and become 0.
    glm::dvec3 boxMin() const { return tidy(least); }
    glm::dvec3 boxMax() const { return tidy(largest); }
    glm::dvec3 mean() const { return tidy(sum / static_cast<double>(points)); }

  private:
    glm::dvec3 tidy(glm::dvec3 v) const;
};

/// Adds the world-space point of every fragment of a band. Points are unprojected through their
/// pixels' sample positions.
void addPoints(const View& view, const LayeredImage& band, PointStatistics& statistics);

// Defined in layer_checks.cpp.

/// The number of pixels that break a rule, and the first such pixel.
struct BrokenPixels {
    std::uint64_t pixels = 0;
    int x = 0, y = 0;

    void add(int at_x, int at_y) {
        if (pixels++ == 0) x = at_x, y = at_y;
    }
};

/// Adds the pixels whose Z decreases from one fragment to the next.
void findUnsorted(const LayeredImage& band, BrokenPixels& broken);

/// Adds the pixels with a fragment whose Z is not finite.
void findInfinite(const LayeredImage& band, BrokenPixels& broken);

/// Adds the pixels whose stored composite differs, in any bit of colour or Z, from the composite of
/// the fragments. `stored` must have the band's window. `type` is the type of the stored colours.
void findWrongComposite(const LayeredImage& band, const CompositeImage& stored, PixelType type,
                        BrokenPixels& broken);

}  // namespace peeler
