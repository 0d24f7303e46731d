// SPDX-License-Identifier: Apache-2.0
// Alpha test of surface points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "core/raster/alpha_ranges.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The alpha test: against the cutoff for MASK materials, against 0 for BLEND materials
/// (core/README.md, "What a fragment is"). Samples the base colour texture at its finest level, at
/// any distance.
class AlphaTest {
  public:
    AlphaTest(const PosedScene& posed, const Geometry& geometry);

    /// Tests a point of the triangle with these vertices. The weights add up to 1.
    bool passes(const std::array<std::uint32_t, 3>& vertex,
                const std::array<double, 3>& weight) const;

    /// Returns whether all points of the triangle pass (true) or none (false); nullopt if this is
    /// not known without testing them. `ranges` must be those of image(), and may be null without
    /// an image.
    std::optional<bool> passesEverywhere(const std::array<std::uint32_t, 3>& vertex,
                                         const AlphaRanges* ranges) const;
    /// Returns the base colour's image, or null for a material without one.
    const Image* image() const { return image_; }

  private:
    bool passes(double alpha) const;

    const Material* material_;
    const Image* image_ = nullptr;
    const std::vector<glm::vec2>* texcoords_ = nullptr;  ///< the UV set that the image uses
    const std::vector<glm::vec4>* colors_;
};

}  // namespace peeler
