// SPDX-License-Identifier: Apache-2.0
// All hits of a bundle, captured from a source, and bundles with rays at chosen positions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/bundle.h>
#include "core/fragments/hit_source.h"

namespace peeler::test {

struct TracedHits {
    Plan plan;
    CaptureReport report;
    LayeredImage image;  ///< all bands joined
    std::vector<Window> bands;

    std::vector<std::uint32_t> keys(std::size_t pixel) const {
        const auto all = image.extra.front().as<std::uint32_t>();
        return {all.begin() + image.offsets[pixel], all.begin() + image.offsets[pixel + 1]};
    }
};

/// A sink that stacks bands vertically.
class JoiningSink final : public Sink {
  public:
    explicit JoiningSink(TracedHits& traced) : traced_(traced) {}
    void begin(const Plan&) override {}
    void finish() override {}
    void write(LayeredImage&& band) override {
        traced_.bands.push_back(band.window);
        LayeredImage& all = traced_.image;
        if (traced_.bands.size() == 1) {
            all = band;
            return;
        }
        all.window.y1 = band.window.y1;
        const std::uint32_t before = all.offsets.back();
        for (std::size_t i = 1; i < band.offsets.size(); ++i)
            all.offsets.push_back(before + band.offsets[i]);
        all.z.insert(all.z.end(), band.z.begin(), band.z.end());
        append(all.color, band.color);
        for (std::size_t i = 0; i < all.extra.size(); ++i)
            append(all.extra[i], band.extra[i]);
    }

  private:
    static void append(FragmentArray& to, const FragmentArray& from) {
        to.data.insert(to.data.end(), from.data.begin(), from.data.end());
    }

    TracedHits& traced_;
};

inline CaptureSettings hitSettings(HitMode hit_mode = HitMode::kRefined) {
    CaptureSettings settings;
    settings.hit_mode = hit_mode;
    settings.faces = Faces::kBoth;
    settings.depth_clamp = true;
    settings.color_type = PixelType::kFloat;
    return settings;
}

inline TracedHits trace(HitSource& source, const View& view,
                        const CaptureSettings& settings = hitSettings()) {
    TracedHits traced;
    const CapturePlan plan = source.plan(view, settings);
    traced.plan = plan;
    JoiningSink sink(traced);
    traced.report = source.capture(plan, sink);
    return traced;
}

/// Returns a view with parallel rays along −Z that start at Z = 0, one unit apart. The picture's
/// upper left corner is at the origin, so the ray of pixel (x, y) goes through (x + 0.5, −y − 0.5).
inline View parallelView(int width, int height, double far = 100) {
    View view;
    view.width = width;
    view.height = height;
    view.crop = {0, 0, width, height};
    view.projection.perspective = false;
    view.projection.half_width = width / 2.0;
    view.projection.half_height = height / 2.0;
    view.projection.near = 0;
    view.projection.far = far;
    view.camera_to_world[3] = glm::dvec4(width / 2.0, -height / 2.0, 0, 1);
    return view;
}

/// Returns the view of a pinhole camera at `eye` that looks at the origin.
inline View pinhole(const glm::dvec3& eye, int size, double half = 0.6, double near = 0.01) {
    View view;
    view.camera_to_world = *lookAlong(eye, -eye, {0.1, 1, 0.2});
    view.width = view.height = size;
    view.crop = {0, 0, size, size};
    view.projection.half_width = view.projection.half_height = half;
    view.projection.near = near;
    return view;
}

inline Bundle bundleOf(const PosedScene& posed, const glm::dvec3& direction, int resolution) {
    const Bounds all = posed.bounds().value();
    RayGrid grid;
    grid.resolution = resolution;
    return parallelBundle("b", all, all, direction, grid);
}

/// Returns a square of two triangles that faces +Z, from (x0, −y1) to (x1, −y0). The arguments are
/// in pixel coordinates of parallelView().
inline Primitive square(float x0, float y0, float x1, float y1, float z) {
    Primitive primitive;
    primitive.positions = {{x0, -y1, z}, {x1, -y1, z}, {x1, -y0, z}, {x0, -y0, z}};
    primitive.texcoords[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    return primitive;
}

/// Returns the number of hits for each ray.
inline std::vector<std::uint32_t> countsOf(const LayeredImage& image) {
    std::vector<std::uint32_t> counts;
    for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p)
        counts.push_back(image.count(p));
    return counts;
}

}  // namespace peeler::test
