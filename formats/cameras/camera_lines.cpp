// SPDX-License-Identifier: Apache-2.0
// JSON lines of cameras, peeler's own format: one JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include <peeler/view.h>
#include "formats/cameras/camera_formats.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

constexpr std::string_view kKeys[] = {
    "name",          "size",        "K",      "fx",         "fy",   "cx",  "cy",
    "fov",           "orthoHeight", "lens",   "distortion", "near", "far", "cameraToWorld",
    "worldToCamera", "eye",         "target", "up"};

void checkKeys(const CameraObject& line) {
    for (const auto& [key, value] : line.value().items())
        if (std::ranges::find(kKeys, key) == std::end(kKeys))
            refuseCamera(
                "unknown key \"" + key + "\"", line.where(),
                "give only name, size, K or fx, fy, cx, cy, fov, orthoHeight, lens, "
                "distortion, near, far, and cameraToWorld, worldToCamera or eye, target, up");
}

/// Returns the number of keys that are present, 0 or 1. Throws Error (kInput) if it is above 1.
int oneOf(const CameraObject& line, std::initializer_list<const char*> keys) {
    std::string found;
    int count = 0;
    for (const char* key : keys) {
        if (!line.has(key)) continue;
        found += (count++ ? " and " : "") + std::string(key);
    }
    if (count > 1) refuseCamera("a camera takes only one of " + found, line.where());
    return count;
}

/// Returns a number above 0 and below `most`, if present.
std::optional<double> positive(const CameraObject& line, const char* key, double most) {
    const auto number = line.number(key);
    if (number && !(*number > 0 && *number < most))
        refuseCamera("expected a number above 0" +
                         (std::isinf(most) ? std::string() : " and below " + cameraNumber(most)),
                     line.where(key));
    return number;
}

std::optional<glm::dvec3> vector(const CameraObject& line, const char* key) {
    const auto numbers = line.numbers(key, 3);
    if (!numbers) return {};
    return glm::dvec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

glm::dmat4 placeIn(const CameraObject& line, bool z_up) {
    if (oneOf(line, {"cameraToWorld", "worldToCamera", "eye"}) == 0)
        refuseCamera("the camera's place is missing", line.where(),
                     "give cameraToWorld, worldToCamera, or eye and target");
    if (!line.has("eye"))
        for (const char* key : {"target", "up"})
            if (line.has(key))
                refuseCamera("\"" + std::string(key) + "\" needs \"eye\"", line.where(key));
    if (const auto matrix = line.matrix("cameraToWorld"))
        return checkedPose(*matrix, line.where("cameraToWorld"));
    if (const auto matrix = line.matrix("worldToCamera"))
        return poseOfOpencv(*matrix, line.where("worldToCamera"));
    const glm::dvec3 eye = line.required(vector(line, "eye"), "eye"),
                     target = line.required(vector(line, "target"), "target");
    const auto up = vector(line, "up");
    const glm::dvec3 upwards = z_up ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    auto place = lookAlong(eye, target - eye, up.value_or(upwards));
    // If the camera looks straight down or up, north is up, as for CameraChoice.
    if (!place && !up)
        place = lookAlong(eye, target - eye, z_up ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1));
    if (!place)
        refuseCamera(eye == target ? "the eye is at the target"
                                   : "up is parallel to the viewing direction, or 0",
                     line.where(eye == target ? "target" : "up"));
    return *place;
}

/// Returns the lens in "lens" and "distortion" (default: opencv, no coefficients).
std::optional<Lens> lensOf(const CameraObject& line, const CameraFileOptions& options) {
    const nlohmann::json* const list = line.find("distortion");
    const auto model = line.text("lens");
    if (!model && !list) return {};
    std::vector<double> coefficients;
    if (list) coefficients = *line.numbers("distortion", list->size());
    return checkedLens(
        options, model.value_or("opencv"), std::move(coefficients),
        {"lens distortion is not rendered", line.where(model ? "lens" : "distortion"), kUndistort});
}

void takeLens(const CameraObject& line, const CameraFileOptions& options, FileCamera& camera) {
    camera.lens = lensOf(line, options);
    oneOf(line, {"K", "fx", "fov", "orthoHeight"});
    if (const auto k = line.rows("K", 3, 3))
        camera.intrinsics =
            intrinsicsOfK(std::span<const double, 9>(k->data(), 9), line.where("K"));
    const bool has_any = std::ranges::any_of(std::array{"fx", "fy", "cx", "cy"},
                                             [&](const char* key) { return line.has(key); });
    if (has_any) {
        const auto number = [&](const char* key) { return line.required(line.number(key), key); };
        camera.intrinsics = checkedIntrinsics(
            {number("fx"), number("fy"), number("cx"), number("cy")}, line.where());
    }
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    constexpr double kHalfTurn = 180;
    camera.fov = positive(line, "fov", kHalfTurn);
    camera.ortho_height = positive(line, "orthoHeight", kInfinite);
    camera.near = line.number("near");
    camera.far = line.number("far");
    checkDepthPlanes(camera, line.where());
}

FileCamera cameraOf(const CameraObject& line, const CameraFileOptions& options) {
    checkKeys(line);
    FileCamera camera;
    camera.name = line.text("name").value_or("");
    const auto size = line.numbers("size", 2);
    camera.size = size ? checkedSize((*size)[0], (*size)[1], line.where("size")) : options.size;
    takeLens(line, options, camera);
    camera.camera_to_world = placeIn(line, options.convention == CameraConvention::kBlender);
    return camera;
}

/// Calls take(line, number) for every line that is not blank. The first line has the number 1.
template <class Take>
void forLines(std::string_view text, const Take& take) {
    for (std::uint64_t number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.find_first_not_of(" \t\r") != std::string_view::npos) take(line, number);
    }
}

std::vector<FileCamera> readCameraLines(const CameraSource& source) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(source.path);
    std::uint64_t count = 0;
    forLines(asText(bytes), [&](std::string_view, std::uint64_t) { ++count; });
    checkViewCount(count, source.path.string());
    std::vector<FileCamera> cameras;
    cameras.reserve(count);
    forLines(asText(bytes), [&](std::string_view line, std::uint64_t number) {
        constexpr std::size_t kLongestLine = std::size_t{1} << 20;
        const std::string where = source.path.string() + ":" + std::to_string(number);
        if (line.size() > kLongestLine) refuseCamera("the line is too long for a camera", where);
        const nlohmann::json value = parseJson(line, where);
        cameras.push_back(cameraOf(CameraObject(value, where, ""), source.options));
    });
    return cameras;
}

bool isCameraLines(const CameraSource& source) {
    return lowerExtension(source.path) == ".jsonl";
}

}  // namespace

const CameraFormat kCameraLinesFormat = {
    "lines of cameras", {}, isCameraLines, readCameraLines, nullptr, nullptr, nullptr};

}  // namespace peeler
