// SPDX-License-Identifier: Apache-2.0
// The context of a pass over the scene.
#pragma once

#include <peeler/capture_settings.h>
#include <peeler/view.h>

namespace peeler {

class Lighting;

/// The view, settings and lighting of a capture.
struct PassContext {
    View view;
    CaptureSettings settings;  ///< of GL's passes
    /// The requested surfaces. If the scene has splats, GL captures all surfaces, and those hidden
    /// are removed afterwards, because they also hide splats.
    Surfaces shown = Surfaces::kAll;
    const Lighting* lighting = nullptr;  ///< null: no lights
};

}  // namespace peeler
