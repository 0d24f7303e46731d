// SPDX-License-Identifier: Apache-2.0
// Calibrated cameras: views whose pictures have given intrinsics.
#pragma once

#include <peeler/camera_choice.h>
#include <peeler/view.h>
#include "core/lens/picture_rays.h"

namespace peeler {

/// Applies intrinsics to a view. The picture keeps its size. Throws Error (kUsage) if the
/// intrinsics are not positive and finite, if the view is orthographic, or if the principal point
/// is too far outside the picture.
void setIntrinsics(View& view, const Intrinsics& camera);

/// Gives a view the rays of a lens, which begin at the eye. Throws Error (kUsage) if the view is
/// orthographic, or like LensRays::LensRays().
void setLens(View& view, const LensCamera& camera);

}  // namespace peeler
