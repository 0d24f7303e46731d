// SPDX-License-Identifier: Apache-2.0
// The table of formats of files of cameras, and what their readers and writers share.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include <peeler/text.h>
#include "formats/cameras/camera_file.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// What is read: a file or folder, and what was asked for.
struct CameraSource {
    CameraSource(std::filesystem::path from, const CameraFileOptions& asked, ReadWarnings& warned)
        : path(std::move(from)), options(asked), warnings(warned) {}

    std::filesystem::path path;
    CameraFileOptions options;
    ReadWarnings& warnings;

    /// What the file, a .json, says; parsed once.
    const nlohmann::json& json() const;

  private:
    mutable std::shared_ptr<const nlohmann::json> json_;
};

/// One format: a file of this folder, and a row of the table.
struct CameraFormat {
    const char* name;  ///< in messages
    /// The axes that its poses have; where its files do not say, nothing.
    std::optional<CameraConvention> convention;
    bool (*holds)(const CameraSource& source);  ///< by its name, or what is in it
    /// May leave the world as the file has it, and names empty, which then are the views' numbers.
    std::vector<FileCamera> (*read)(const CameraSource& source);
    // Of formats that are written; else null.
    bool (*written)(const std::filesystem::path& path);  ///< by such a name
    /// The files of such a name.
    std::vector<std::filesystem::path> (*files)(const std::filesystem::path& path);
    /// The texts of files(), in that order; the last ones may be missing.
    std::vector<std::string> (*write)(const std::filesystem::path& path,
                                      std::span<const FileCamera> cameras,
                                      const CameraOutputOptions& options);
};

extern const CameraFormat kTransformsFormat, kBopFormat, kColmapFormat, kPoseArrayFormat,
    kCameraLinesFormat;

// camera_checks.cpp.

/// Throws Error (kInput).
[[noreturn]] void refuseCamera(const Text& what, const Text& where, const Text& hint = {});

/// The bytes of a file of cameras. Throws Error (kInput).
std::vector<std::uint8_t> readCameraBytes(const std::filesystem::path& path);
/// They as a text.
std::string_view asText(std::span<const std::uint8_t> bytes);
/// The JSON of a file of cameras that has no more values than kMostViews of them need.
nlohmann::json readCameraJson(const std::filesystem::path& path);

/// Throws unless there is at least one view and no more than kMostViews.
void checkViewCount(std::uint64_t count, const std::string& where);

/// A camera's matrix, checked to be rigid. Throws Error (kInput).
const glm::dmat4& checkedPose(const glm::dmat4& matrix, const std::string& where);
/// World to camera, in OpenCV's axes, as FileCamera has it; checked.
glm::dmat4 poseOfOpencv(const glm::dmat4& world_to_camera, const std::string& where);
/// The other way round, of a rigid matrix.
glm::dmat4 opencvOfPose(const glm::dmat4& camera_to_world);
/// The inverse of a rigid matrix.
glm::dmat4 rigidInverse(const glm::dmat4& matrix);

/// Focal lengths above 0, all finite. Throws Error (kInput).
Intrinsics checkedIntrinsics(const Intrinsics& intrinsics, const std::string& where);
/// The intrinsics of K, row by row, whose pixels are counted as ours are.
Intrinsics intrinsicsOfK(std::span<const double, 9> k, const std::string& where);
/// A picture's size. Throws Error (kInput) if it is not whole, or not from 1 to the limits.
Size checkedSize(double width, double height, const std::string& where);

/// Throws Error (kInput) for near and far planes that leave nothing between them.
void checkDepthPlanes(const FileCamera& camera, const std::string& where);

/// What the hint says to lens distortion.
inline constexpr const char* kUndistort = "undistort the pictures first";

/// The part of a file name that names a view: without folder and extension.
std::string viewName(const std::string& picture);

/// An object of a JSON file of cameras, and where it stands: "file.json, /frames/3".
class CameraObject {
  public:
    /// `value` has to stay. Throws Error (kInput) if it is no object.
    CameraObject(const nlohmann::json& value, std::string file, std::string pointer);

    const nlohmann::json& value() const { return value_; }
    const std::string& pointer() const { return pointer_; }
    /// What messages name: the object, or a member.
    std::string where() const;
    std::string where(std::string_view key) const;

    /// The member; null if it is not there, or is null.
    const nlohmann::json* find(const char* key) const;
    bool has(const char* key) const { return find(key) != nullptr; }
    /// A finite number, if it is there. Throws Error (kInput) if it is something else.
    std::optional<double> number(const char* key) const;
    /// So many finite numbers, if they are there.
    std::optional<std::vector<double>> numbers(const char* key, std::size_t count) const;
    /// Numbers row by row: `rows` lists of `columns` each, if they are there.
    std::optional<std::vector<double>> rows(const char* key, std::size_t count,
                                            std::size_t columns) const;
    /// An affine matrix of 3 or 4 rows, the last one 0, 0, 0, 1, if it is there.
    std::optional<glm::dmat4> matrix(const char* key) const;
    std::optional<std::string> text(const char* key) const;
    /// The value that has to be there. Throws Error (kInput).
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

/// An affine matrix from its rows, 12 or 16 numbers. Throws Error (kInput) if they are not finite,
/// or a fourth row is not 0, 0, 0, 1.
glm::dmat4 matrixOfRows(std::span<const double> numbers, const std::string& where);

// camera_writing.cpp.

/// The shortest text of a number that reads back as the same, with its sign if it is 0.
std::string cameraNumber(double number);
/// They, `separator` between them.
std::string cameraNumbers(std::span<const double> numbers, const char* separator = ", ");
/// A text in quotation marks, as JSON has it; bytes that are no UTF-8 are replaced.
std::string jsonText(const std::string& text);
/// The numbers of a matrix row by row, of the upper left part of this size.
std::vector<double> rowsOf(const glm::dmat4& matrix, int rows, int columns = 4);
/// The intrinsics that a format writes of a camera. Throws Error (kUsage) for an orthographic one,
/// and one whose size is not known.
Intrinsics writtenIntrinsics(const FileCamera& camera);

}  // namespace peeler
