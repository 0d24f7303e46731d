// SPDX-License-Identifier: Apache-2.0
// The table of camera file formats, and the helpers shared by their readers and writers.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include <peeler/text.h>
#include "formats/cameras/camera_file.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// A camera file or folder to read, with the read options.
struct CameraSource {
    CameraSource(std::filesystem::path from, const CameraFileOptions& asked, ReadWarnings& warned)
        : path(std::move(from)), options(asked), warnings(warned) {}

    std::filesystem::path path;
    CameraFileOptions options;
    ReadWarnings& warnings;

    /// Returns the file, a .json, parsed once.
    const nlohmann::json& json() const;

  private:
    mutable std::shared_ptr<const nlohmann::json> json_;
};

/// A camera format: a file of this folder, and a row of the table.
struct CameraFormat {
    const char* name;  ///< in messages
    /// The axes of its poses; nothing if its files do not define them.
    std::optional<CameraConvention> convention;
    bool (*holds)(const CameraSource& source);  ///< by name or content
    /// May leave the world as in the file, and names empty; they become the views' numbers.
    std::vector<FileCamera> (*read)(const CameraSource& source);
    // Null for formats that are only read.
    bool (*written)(const std::filesystem::path& path);  ///< whether it writes files of this name
    /// Returns the files of this name.
    std::vector<std::filesystem::path> (*files)(const std::filesystem::path& path);
    /// Returns the texts of files(), in that order; the last ones may be missing.
    std::vector<std::string> (*write)(const std::filesystem::path& path,
                                      std::span<const FileCamera> cameras,
                                      const CameraOutputOptions& options);
};

extern const CameraFormat kTransformsFormat, kBopFormat, kColmapFormat, kPoseArrayFormat,
    kCameraLinesFormat;

// camera_checks.cpp.

/// Throws Error (kInput).
[[noreturn]] void refuseCamera(const Text& what, const Text& where, const Text& hint = {});

/// Returns the bytes of a camera file. Throws Error (kInput).
std::vector<std::uint8_t> readCameraBytes(const std::filesystem::path& path);
/// Returns bytes as text.
std::string_view asText(std::span<const std::uint8_t> bytes);
/// Returns the JSON of a camera file. Throws Error (kInput) if it has more values than kMostViews
/// need.
nlohmann::json readCameraJson(const std::filesystem::path& path);

/// Throws Error (kInput) unless there are 1 to kMostViews views.
void checkViewCount(std::uint64_t count, const std::string& where);

/// Returns a camera's matrix, checked to be rigid. Throws Error (kInput) otherwise.
const glm::dmat4& checkedPose(const glm::dmat4& matrix, const std::string& where);
/// Converts world to camera in OpenCV's axes to FileCamera::camera_to_world; checked.
glm::dmat4 poseOfOpencv(const glm::dmat4& world_to_camera, const std::string& where);
/// The inverse of poseOfOpencv(), for a rigid matrix.
glm::dmat4 opencvOfPose(const glm::dmat4& camera_to_world);
/// Returns the inverse of a rigid matrix.
glm::dmat4 rigidInverse(const glm::dmat4& matrix);

/// Returns the intrinsics. Throws Error (kInput) unless focal lengths are above 0, and all values
/// finite.
Intrinsics checkedIntrinsics(const Intrinsics& intrinsics, const std::string& where);
/// Returns the intrinsics of a matrix K, row-major, with our pixel coordinates.
Intrinsics intrinsicsOfK(std::span<const double, 9> k, const std::string& where);
/// Returns a picture's size. Throws Error (kInput) unless it is whole, and between 1 and the
/// limits.
Size checkedSize(double width, double height, const std::string& where);

/// Throws Error (kInput) if there is nothing between the near and far planes.
void checkDepthPlanes(const FileCamera& camera, const std::string& where);

/// The hint for lens distortion.
inline constexpr const char* kUndistort = "undistort the pictures first";

/// Returns the part of a file name that names a view: without folder and extension.
std::string viewName(const std::string& picture);

/// An object in a JSON camera file, and its place: "file.json, /frames/3".
class CameraObject {
  public:
    /// `value` must outlive it. Throws Error (kInput) if it is not an object.
    CameraObject(const nlohmann::json& value, std::string file, std::string pointer);

    const nlohmann::json& value() const { return value_; }
    const std::string& pointer() const { return pointer_; }
    /// Returns the place for messages: of the object, or of a member.
    std::string where() const;
    std::string where(std::string_view key) const;

    /// Returns the member; null if it is missing, or is null.
    const nlohmann::json* find(const char* key) const;
    bool has(const char* key) const { return find(key) != nullptr; }
    /// Returns a finite number, if present. Throws Error (kInput) if it is anything else.
    std::optional<double> number(const char* key) const;
    /// Returns `count` finite numbers, if present.
    std::optional<std::vector<double>> numbers(const char* key, std::size_t count) const;
    /// Returns numbers row by row: `count` lists of `columns` each, if present.
    std::optional<std::vector<double>> rows(const char* key, std::size_t count,
                                            std::size_t columns) const;
    /// Returns an affine matrix of 3 or 4 rows, the last one 0, 0, 0, 1, if present.
    std::optional<glm::dmat4> matrix(const char* key) const;
    std::optional<std::string> text(const char* key) const;
    /// Returns a required value. Throws Error (kInput) if it is missing.
    template <class T>
    T required(const std::optional<T>& value, const char* key) const {
        if (!value) missing(key);
        return *value;
    }

  private:
    [[noreturn]] void missing(const char* key) const;
    std::vector<double> list(const nlohmann::json& value, const std::string& pointer,
                             std::size_t count) const;

    const nlohmann::json& value_;
    std::string file_, pointer_;
};

/// Warns of each member whose key is not in `known`.
void warnOfOthers(const CameraObject& object, std::span<const std::string_view> known,
                  ReadWarnings& warnings);

/// Returns an affine matrix from its rows, 12 or 16 numbers. Throws Error (kInput) if they are not
/// finite, or the fourth row is not 0, 0, 0, 1.
glm::dmat4 matrixOfRows(std::span<const double> numbers, const std::string& where);

// camera_writing.cpp.

/// Returns the shortest text of a number that reads back the same, including the sign of 0.
std::string cameraNumber(double number);
/// Returns the texts of numbers, joined by `separator`.
std::string cameraNumbers(std::span<const double> numbers, const char* separator = ", ");
/// Returns a text as a JSON string; invalid UTF-8 is replaced.
std::string jsonText(const std::string& text);
/// Returns the elements of a matrix's upper left block of this size, row by row.
std::vector<double> rowsOf(const glm::dmat4& matrix, int rows, int columns = 4);
/// Returns a camera's intrinsics for writing. Throws Error (kUsage) for an orthographic camera, or
/// one of unknown size.
Intrinsics writtenIntrinsics(const FileCamera& camera);

}  // namespace peeler
