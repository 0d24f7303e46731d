// SPDX-License-Identifier: Apache-2.0
// A capture plan of the GlRenderer: the capture settings and the results of the count pass.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include <peeler/window.h>
#include "core/capture/method.h"
#include "core/fragments/hit_source.h"
#include "core/image/layers.h"

namespace peeler {

// The size limit of planning results that are kept for the capture: 1/kKeptShare of the budget or,
// without a budget, kKeptBytes. Larger results are computed again.
inline constexpr std::uint64_t kKeptShare = 6;
inline constexpr std::uint64_t kKeptBytes = 256ULL << 20;

// The size limit of the buffers with which ShadePer::kAuto shades once per pixel: 1/kSampleShare of
// a budget.
inline constexpr std::uint64_t kSampleShare = 4;

struct GlPlan final : CapturePlan::Details {
    View view;
    /// The requested settings, except that `surfaces` is chosen for the scene.
    CaptureSettings settings;
    const MethodInfo* method = nullptr;
    std::vector<glm::dvec2> positions{};  ///< sample positions in a pixel, each captured as a view
    /// Whether the CPU finds fragments: of views with View::rays, and of splats. Methods then
    /// capture none, or only the surfaces.
    bool on_cpu = false;
    bool opaque_first = false;   ///< whether to use compositeVisible()
    bool shades_pixels = false;  ///< whether to use compositeSamples()
    Window drawn{};              ///< if opaque_first, the window that can contain fragments

    /// By row: the number of clip-mesh surfaces, maximum over the views.
    std::vector<std::uint64_t> clip_rows{};
    std::optional<DepthComplexity> counted{};  ///< depth complexity of all samples together
    std::optional<DepthComplexity> merged{};   ///< depth complexity after the samples are merged
    std::uint32_t limit = 0;                   ///< number of nearest layers to keep; 0 = all
    double share = 0;                          ///< planning's share of the total work, for progress

    // Planning results. Only a renderer's latest plan has them.
    std::vector<std::uint32_t> kept_counts{};  ///< by sample, then by pixel of the crop
    std::vector<LayeredImage> kept_bands{};    ///< bands captured while counting; empty unless kept
    int kept_passes = 0;                       ///< geometry passes that captured kept_bands

    bool mergesLayers() const { return positions.size() > 1 && !settings.composite; }
    bool fitsKept(std::uint64_t bytes) const {
        return bytes <= (settings.memory != 0 ? settings.memory / kKeptShare : kKeptBytes);
    }
    void freeKept() {
        kept_counts = {};
        kept_bands = {};
    }
};

}  // namespace peeler
