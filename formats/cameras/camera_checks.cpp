// SPDX-License-Identifier: Apache-2.0
// Checks shared by all camera formats, and conversion of pose conventions.
#include <algorithm>
#include <cmath>

#include <peeler/error.h>
#include "core/scene/camera_choice.h"
#include "core/scene/view.h"
#include "formats/cameras/camera_formats.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

/// Converts a camera-to-world matrix between glTF's camera axes and OpenCV's (+Y down, view along
/// +Z).
glm::dmat4 withAxesTurned(glm::dmat4 camera_to_world) {
    camera_to_world[1] = glm::dvec4(0) - camera_to_world[1];  // 0 − x instead of −x, to avoid −0
    camera_to_world[2] = glm::dvec4(0) - camera_to_world[2];
    return camera_to_world;
}

}  // namespace

void refuseCamera(const Text& what, const Text& where, const Text& hint) {
    throw Error(ErrorKind::kInput, what, where, hint);
}

std::vector<std::uint8_t> readCameraBytes(const std::filesystem::path& path) {
    return readRegularFile(path, kMostCameraBytes);
}

std::string_view asText(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

nlohmann::json readCameraJson(const std::filesystem::path& path) {
    // Count the values before parsing, because a parsed value takes up to ten times the memory of
    // its text.
    constexpr std::uint64_t kMostValues = 64 * kMostViews;
    const std::vector<std::uint8_t> bytes = readCameraBytes(path);
    const std::string_view text = asText(bytes);
    const auto values =
        std::ranges::count_if(text, [](char c) { return c == ',' || c == '[' || c == '{'; });
    if (static_cast<std::uint64_t>(values) > kMostValues)
        refuseCamera(
            "the file is too large; at most " + std::to_string(kMostViews) + " views are read",
            path.string(), "split the file");
    return parseJson(text, path.string());
}

void checkViewCount(std::uint64_t count, const std::string& where) {
    if (count == 0) refuseCamera("the file has no cameras", where);
    if (count > kMostViews)
        refuseCamera("there are " + std::to_string(count) + " views, but the limit is " +
                         std::to_string(kMostViews),
                     where, "split the file");
}

const glm::dmat4& checkedPose(const glm::dmat4& matrix, const std::string& where) {
    constexpr double kMost = 1e-4;
    if (distanceFromRigid(matrix) < kMost) return matrix;
    refuseCamera("the pose is not a rotation and a translation", where,
                 "scale the scene instead of the pose; if an axis is mirrored, give another " +
                     Parameter::kConvention);
}

glm::dmat4 rigidInverse(const glm::dmat4& matrix) {
    const glm::dmat3 turn = glm::transpose(glm::dmat3(matrix));
    glm::dmat4 inverse(turn);
    inverse[3] = glm::dvec4(glm::dvec3(0) - turn * glm::dvec3(matrix[3]), 1);
    return inverse;
}

glm::dmat4 poseOfOpencv(const glm::dmat4& world_to_camera, const std::string& where) {
    glm::dmat4 turn = glm::dmat4(glm::dmat3(checkedPose(world_to_camera, where)));
    // Make the rows orthonormal, not the columns, because the rows are the camera's axes in world
    // space, and the eye's position is calculated from them.
    if (!(distanceFromRigid(turn) < kRigidByRounding))
        turn = glm::transpose(rigid(glm::transpose(turn)).value_or(turn));
    turn[3] = world_to_camera[3];
    return withAxesTurned(rigidInverse(turn));
}

glm::dmat4 opencvOfPose(const glm::dmat4& camera_to_world) {
    return rigidInverse(withAxesTurned(camera_to_world));
}

Intrinsics checkedIntrinsics(const Intrinsics& intrinsics, const std::string& where) {
    for (const double number : {intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy})
        if (!std::isfinite(number)) refuseCamera("the intrinsics are not finite", where);
    if (!(intrinsics.fx > 0 && intrinsics.fy > 0))
        refuseCamera("focal lengths must be above 0", where,
                     "flip the picture instead of the camera");
    return intrinsics;
}

Intrinsics intrinsicsOfK(std::span<const double, 9> k, const std::string& where) {
    if (k[1] != 0)
        refuseCamera("K has a skew, which is not rendered", where,
                     "make the pictures' pixels rectangular and set K[0][1] to 0");
    if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
        refuseCamera("K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]", where);
    return checkedIntrinsics({k[0], k[4], k[2], k[5]}, where);
}

std::optional<Lens> checkedLens(const CameraFileOptions& options, std::string_view model,
                                std::vector<double> coefficients, const LensRefusal& refusal) {
    std::optional<Lens> lens;
    try {
        lens = makeLens(model, std::move(coefficients));
    } catch (const Error& error) {
        refuseCamera(error.whatText(), refusal.where, error.hintText());
    }
    if (isPinhole(*lens)) return {};
    if (!options.lenses) refuseCamera(refusal.what, refusal.where, refusal.hint);
    return lens;
}

Size checkedSize(double width, double height, const std::string& where) {
    for (const double side : {width, height})
        if (!(side >= 1 && side <= kMostPictureSide) || side != std::floor(side))
            refuseCamera("a picture must be 1 to " + std::to_string(kMostPictureSide) +
                             " pixels wide and high",
                         where);
    const Size size{static_cast<int>(width), static_cast<int>(height)};
    if (static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height) >
        kMostPixels)
        refuseCamera("the picture has more than " + std::to_string(kMostPixels) + " pixels", where);
    return size;
}

void checkDepthPlanes(const FileCamera& camera, const std::string& where) {
    const bool is_in_front =
        !camera.near || (camera.ortho_height ? *camera.near >= 0 : *camera.near > 0);
    if (!is_in_front) refuseCamera("the near plane must lie in front of the eye", where);
    if (camera.far && !(*camera.far > camera.near.value_or(0)))
        refuseCamera("the near plane must lie before the far plane", where);
}

std::string viewName(const std::string& picture) {
    const std::size_t slash = picture.find_last_of("/\\");
    std::string name = slash == std::string::npos ? picture : picture.substr(slash + 1);
    // Keep an ending that begins with a digit: picture names in NeRF's files have no extension, but
    // may end in a dot and a number.
    const std::size_t dot = name.rfind('.');
    const auto isLetter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    if (dot != std::string::npos && dot > 0 && dot + 1 < name.size() && isLetter(name[dot + 1]))
        name.resize(dot);
    return name;
}

glm::dmat4 matrixOfRows(std::span<const double> numbers, const std::string& where) {
    glm::dmat4 matrix(1);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (!std::isfinite(numbers[i])) refuseCamera("the matrix is not finite", where);
        matrix[static_cast<int>(i % 4)][static_cast<int>(i / 4)] = numbers[i];
    }
    for (int column = 0; column < 4; ++column)
        if (matrix[column][3] != (column == 3 ? 1 : 0))
            refuseCamera("the matrix's last row must be 0, 0, 0, 1", where,
                         "give matrices for column vectors, row by row");
    return matrix;
}

}  // namespace peeler
