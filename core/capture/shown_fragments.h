// SPDX-License-Identifier: Apache-2.0
// The fragments that opaque surfaces do not hide, among fragments that the CPU orders.
#pragma once

#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// Selects fragments as GL's passes do (core/README.md, "What a fragment is").
class ShownFragments {
  public:
    explicit ShownFragments(PosedScene posed);

    /// Removes the fragments that `surfaces` and `opaque_only` exclude. The first extra array of
    /// the image must hold the keys.
    void keep(Surfaces surfaces, bool opaque_only, LayeredImage& image) const;

    /// Returns the Z of each pixel's nearest opaque fragment; infinite = none. The first extra
    /// array of the image must hold the keys.
    std::vector<float> nearestOpaque(const LayeredImage& image) const;

  private:
    PosedScene posed_;
    std::vector<char> opaque_;  ///< by surface of the draw list
};

}  // namespace peeler
