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
    CaptureSettings settings;
    const Lighting* lighting = nullptr;  ///< null: no lights
};

}  // namespace peeler
