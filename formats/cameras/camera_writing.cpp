// SPDX-License-Identifier: Apache-2.0
// Helpers for camera writers: text of numbers that reads back unchanged, and checks of cameras.
#include <array>
#include <charconv>
#include <cmath>

#include <peeler/error.h>
#include "formats/cameras/camera_formats.h"
#include "formats/file/json_text.h"

namespace peeler {

std::string cameraNumber(double number) {
    if (number == 0) return std::signbit(number) ? "-0.0" : "0";
    std::array<char, 32> text;
    const auto written = std::to_chars(text.data(), text.data() + text.size(), number);
    return {text.data(), written.ptr};
}

std::string cameraNumbers(std::span<const double> numbers, const char* separator) {
    std::string text;
    for (const double number : numbers)
        text += (text.empty() ? "" : separator) + cameraNumber(number);
    return text;
}

std::string jsonText(const std::string& text) {
    return dumpJson(nlohmann::json(text));
}

std::vector<double> rowsOf(const glm::dmat4& matrix, int rows, int columns) {
    std::vector<double> numbers;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column)
            numbers.push_back(matrix[column][row]);
    return numbers;
}

void refuseLensOutput(const FileCamera& camera, const std::string& what) {
    throw Error(ErrorKind::kUsage, what, "camera " + camera.name,
                "leave this camera out, or write another format");
}

void checkWritten(const FileCamera& camera) {
    const std::string where = "camera " + camera.name;
    if (camera.ortho_height)
        throw Error(ErrorKind::kUsage,
                    "an orthographic camera cannot be written as a calibrated one", where,
                    "leave this camera out");
    if (camera.size.width < 1 || camera.size.height < 1)
        throw Error(ErrorKind::kUsage, "the camera's picture size is unknown", where,
                    "give " + Parameter::kSize);
}

Intrinsics writtenIntrinsics(const FileCamera& camera) {
    checkWritten(camera);
    if (camera.intrinsics) return *camera.intrinsics;
    if (!camera.fov || camera.lens)
        throw Error(ErrorKind::kUsage, "the camera has neither intrinsics nor a field of view",
                    "camera " + camera.name, "give " + Parameter::kFov);
    const double f = camera.size.height / (2 * std::tan(glm::radians(*camera.fov) / 2));
    return {f, f, (camera.size.width - 1) / 2.0, (camera.size.height - 1) / 2.0};
}

}  // namespace peeler
