// SPDX-License-Identifier: Apache-2.0
#include "formats/file/lens_json.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include <peeler/error.h>
#include "core/lens/lens.h"

namespace peeler {

nlohmann::json lensJson(const LensCamera& camera) {
    const auto& [fx, fy, cx, cy] = camera.intrinsics;
    nlohmann::json intrinsics;
    if (!lensModel(camera.lens).filling) intrinsics = {fx, fy, cx, cy};
    return {{"model", camera.lens.model},
            {"coefficients", camera.lens.coefficients},
            {"intrinsics", std::move(intrinsics)}};
}

LensCamera lensOfJson(const nlohmann::json& json, const std::string& where) {
    LensCamera camera;
    try {
        camera.lens = makeLens(json.at("model").get<std::string>(),
                               json.at("coefficients").get<std::vector<double>>());
    } catch (const Error& error) {
        throw Error(ErrorKind::kInput, error.whatText(), where, error.hintText());
    }
    if (lensModel(camera.lens).filling) return camera;
    const auto [fx, fy, cx, cy] = json.at("intrinsics").get<std::array<double, 4>>();
    const bool finite = std::isfinite(fx) && std::isfinite(fy) && std::isfinite(cx + cy);
    if (!(fx > 0 && fy > 0 && finite))
        throw Error(ErrorKind::kInput, "the focal lengths of the lens are not positive", where);
    camera.intrinsics = {fx, fy, cx, cy};
    return camera;
}

}  // namespace peeler
