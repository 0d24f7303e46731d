// SPDX-License-Identifier: Apache-2.0
#include "formats/cameras/calibration.h"

#include <peeler/camera_choice.h>
#include "formats/cameras/camera_file.h"
#include "formats/cameras/camera_formats.h"

namespace peeler {

nlohmann::ordered_json calibrationJson(const View& view) {
    nlohmann::ordered_json json;
    json["size"] = {view.crop.width(), view.crop.height()};
    if (view.projection.perspective) {
        const Intrinsics k = intrinsicsOf(view);
        json["K"] = {{k.fx, 0.0, k.cx}, {0.0, k.fy, k.cy}, {0.0, 0.0, 1.0}};
    }
    const glm::dmat4 to_camera = opencvOfPose(view.camera_to_world);
    for (int row = 0; row < 4; ++row) {
        auto& numbers = json["world_to_camera"].emplace_back();
        for (int column = 0; column < 4; ++column)
            numbers.push_back(to_camera[column][row] + 0.0);  // turns −0 into 0
    }
    json["convention"] =
        cameraConventions()[static_cast<std::size_t>(CameraConvention::kOpencv)].name;
    json["pixel_center"] = 0;
    return json;
}

}  // namespace peeler
