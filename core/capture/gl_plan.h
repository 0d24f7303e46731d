// SPDX-License-Identifier: Apache-2.0
// A capture plan of the GlRenderer: how to capture a view, with the results of the count pass.
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

// Results of planning are kept for the capture if they take at most this share of the budget (or
// this many bytes without one); otherwise they are computed again.
inline constexpr std::uint64_t kKeptShare = 6;
inline constexpr std::uint64_t kKeptBytes = 256ULL << 20;

struct GlPlan final : CapturePlan::Details {
    View view;
    CaptureSettings settings;  ///< with the surfaces to capture, perhaps fewer
    const MethodInfo* method = nullptr;
    std::vector<glm::dvec2> positions{};  ///< sample positions in a pixel: each is a view
    bool opaque_first = false;            ///< composites are captured by compositeVisible()
    Window drawn{};                       ///< with opaque_first: outside of it there is nothing

    std::vector<std::uint64_t> clip_rows{};    ///< clip-mesh surfaces per row, of the worst view
    std::optional<DepthComplexity> counted{};  ///< of all samples together
    std::optional<DepthComplexity> merged{};   ///< of the layers they merge into
    std::uint32_t limit = 0;                   ///< nearest layers to keep; 0 = all
    double share = 0;                          ///< of a picture's work, for progress

    // Only a renderer's latest plan has these.
    std::vector<std::uint32_t> kept_counts{};  ///< of the whole crop, or empty; one view only
    std::vector<LayeredImage> kept_bands{};    ///< the bands of those counts, or empty
    int kept_passes = 0;                       ///< that captured these

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
