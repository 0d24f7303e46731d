// SPDX-License-Identifier: Apache-2.0
// What a pass over the scene is for.
#pragma once

#include "core/capture/capture_settings.h"
#include "core/scene/view.h"

namespace peeler {

class Lighting;

/// What is being captured: how the scene is seen, what of it counts, and what shines on it.
struct Shot {
    View view;
    CaptureSettings settings;
    const Lighting* lighting = nullptr;  ///< none: nothing shines
};

}  // namespace peeler
