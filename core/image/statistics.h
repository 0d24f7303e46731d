// SPDX-License-Identifier: Apache-2.0
// What the fragments of a picture say in a few numbers: how far away they are, where they lie in
// the world, and how many pixels break a rule that must hold of every picture.
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

/// The median Z of the first fragments in the middle ninth of the picture, or of all if there is
/// none; nothing where there is not a single fragment. Scene units.
std::optional<double> medianDepth(const LayeredImage& image, const View& view);

/// Per pixel the mean of the two smallest distinct Z (Woo, "The Shadow Depth Map Revisited",
/// Graphics Gems III, 1992), in scene units; +inf where there is no second one. Two depths are
/// distinct if they differ by more than the rounding of rasterised depths (2^-18 of Z, or of the
/// depth range of an orthographic view): surfaces that coincide but are triangulated differently
/// must not get the midpoint between them, which would lie on both. `out` has a value for each
/// pixel of the window.
void midpoints(const LayeredImage& image, const Projection& projection, std::span<float> out);

/// Number, bounding box and mean of world-space points, accumulated in double precision in the
/// order in which they come, so that the numbers do not depend on how a picture is cut into bands.
struct PointStatistics {
    std::uint64_t points = 0;
    glm::dvec3 least{std::numeric_limits<double>::infinity()};
    glm::dvec3 largest{-std::numeric_limits<double>::infinity()};
    glm::dvec3 sum{0};

    void add(const glm::dvec3& point);
    bool empty() const { return points == 0; }

    /// To be printed: a coordinate below 1e-9 of the box's diagonal is what rounding left of 0, and
    /// is 0.
    glm::dvec3 boxMin() const { return tidy(least); }
    glm::dvec3 boxMax() const { return tidy(largest); }
    glm::dvec3 mean() const { return tidy(sum / static_cast<double>(points)); }

  private:
    glm::dvec3 tidy(glm::dvec3 v) const;
};

/// Adds the world-space point of every fragment of a band, unprojected through its pixel's sample.
void addPoints(const View& view, const LayeredImage& band, PointStatistics& statistics);

// layer_checks.cpp.

/// Pixels that break a rule, and the first of them.
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

/// Adds the pixels whose stored composite, colour or Z, is another than what the fragments make,
/// bit for bit. `stored` has the band's window, and its colours have been half or float.
void findWrongComposite(const LayeredImage& band, const CompositeImage& stored, PixelType type,
                        BrokenPixels& broken);

}  // namespace peeler
