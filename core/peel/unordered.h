// SPDX-License-Identifier: Apache-2.0
// What methods share that composite all fragments at once, in no order.
#pragma once

#include "core/capture/method.h"
#include "core/peel/composite_targets.h"

namespace peeler {

/// The nearest opaque surface, if only the visible is shown; then one geometry pass of all
/// fragments, or of those in front of it; then a formula.
class Unordered final : public CompositeMethod {
  public:
    using Pass = int (CompositeTargets::*)(SceneRasterizer&, const Window&);

    /// `parts` are the targets, `formula` the definitions of resolve.comp.
    Unordered(unsigned parts, Pass pass, const char* formula)
        : parts_(parts), pass_(pass), formula_(formula) {}

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool) const override {
        return CompositeTargets::bytes(parts_, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window, parts_);
        int passes = targets_.addOpaque(rasterizer, area.window);
        passes += (targets_.*pass_)(rasterizer, area.window);
        targets_.resolve(rasterizer, area.window, formula_);
        return passes;
    }

  private:
    unsigned parts_;
    Pass pass_;
    const char* formula_;
    CompositeTargets targets_;
};

}  // namespace peeler
