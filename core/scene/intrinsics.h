// SPDX-License-Identifier: Apache-2.0
// Calibrated cameras: views whose pictures have given intrinsics.
#pragma once

#include <peeler/camera_choice.h>
#include <peeler/view.h>

namespace peeler {

/// Makes the view's picture, of the size that it has, that of these intrinsics. Throws Error
/// (kUsage) for some that are not positive and finite, of an orthographic view, and for an axis
/// that is too far beside the picture.
void setIntrinsics(View& view, const Intrinsics& camera);

}  // namespace peeler
