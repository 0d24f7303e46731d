// SPDX-License-Identifier: Apache-2.0
// Intrinsics of pictures of all directions (LensModel::filling).
#pragma once

#include <peeler/camera_choice.h>

namespace peeler {

/// The units of the plane are radians.
Intrinsics equirectangularFilling(const Size& size);

/// The unit of the plane is a face. Throws Error (kUsage) unless the picture is 6 × 1, 3 × 2, 2 × 3
/// or 1 × 6 square faces.
Intrinsics cubeFilling(const Size& size);

}  // namespace peeler
