// SPDX-License-Identifier: Apache-2.0
// The calibration of a view, as JSON for data sets.
#pragma once

#include <nlohmann/json.hpp>

#include <peeler/view.h>

namespace peeler {

/// Returns the calibration of a view's crop: `size` (width, height), `K` (3 rows, in pixels; only
/// if the view is in perspective), `world_to_camera` (4 rows), `convention` (a name of
/// cameraConventions()) and `pixel_center` (the coordinate of the first pixel's centre).
nlohmann::ordered_json calibrationJson(const View& view);

}  // namespace peeler
