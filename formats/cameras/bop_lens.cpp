// SPDX-License-Identifier: Apache-2.0
#include "formats/cameras/bop_lens.h"

#include <algorithm>
#include <vector>

namespace peeler {

std::optional<nlohmann::json> bopCameraModel(const Lens& lens, const Intrinsics& intrinsics,
                                             const Size& size) {
    constexpr std::string_view kIncluded[] = {"fisheye", "simple-fisheye", "opencv-fisheye",
                                              "rad-tan-thin-prism-fisheye"};
    constexpr std::size_t kFocalsAndCentre = 4, kCoefficients = 12;
    if (std::ranges::find(kIncluded, lensModel(lens).name) == std::end(kIncluded)) return {};
    std::vector<double> parameters = {intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy};
    parameters.insert(parameters.end(), lens.coefficients.begin(), lens.coefficients.end());
    parameters.resize(kFocalsAndCentre + kCoefficients);
    return nlohmann::json{{"projection_model_type", kBopLensType},
                          {"projection_params", parameters},
                          {"image_width", size.width},
                          {"image_height", size.height},
                          {"label", ""},
                          {"serial_number", ""}};
}

}  // namespace peeler
