// SPDX-License-Identifier: Apache-2.0
// The table of camera file formats, and helpers shared by their readers and writers.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include <peeler/text.h>
#include "core/lens/lens.h"
#include "formats/cameras/camera_file.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// A camera file or folder that is being read, with the options for reading it.
struct CameraSource {
    CameraSource(std::filesystem::path from, const CameraFileOptions& asked, ReadWarnings& warned)
        : path(std::move(from)), options(asked), warnings(warned) {}

    std::filesystem::path path;
    CameraFileOptions options;
    ReadWarnings& warnings;

    /// Returns the content of the file, which must be JSON. Parses the file on the first call only.
    const nlohmann::json& json() const;

  private:
    mutable std::shared_ptr<const nlohmann::json> json_;
};

/// A camera format. To add a format, add a source file in this folder and a row in the table.
struct CameraFormat {
    const char* name;  ///< for messages
    /// The convention of the format's poses; nothing if the files do not define it.
    std::optional<CameraConvention> convention;
    /// Whether the source has this format, judged by name or content.
    bool (*holds)(const CameraSource& source);
    /// Reads the views. Does not apply CameraConvention::kBlender to poses. Names may stay empty;
    /// the caller then uses the picture's name or the view's index.
    std::vector<FileCamera> (*read)(const CameraSource& source);
    // The members below are null for formats without a writer.
    /// Whether the path chooses this format for writing.
    bool (*written)(const std::filesystem::path& path);
    /// Returns all files that are read or written for this path.
    std::vector<std::filesystem::path> (*files)(const std::filesystem::path& path);
    /// Returns the contents of files(), in the same order. Contents may be missing at the end.
    std::vector<std::string> (*write)(const std::filesystem::path& path,
                                      std::span<const FileCamera> cameras,
                                      const CameraOutputOptions& options);
};

extern const CameraFormat kTransformsFormat, kBopFormat, kColmapFormat, kPoseArrayFormat,
    kCameraLinesFormat;

// Defined in camera_checks.cpp.

[[noreturn]] void refuseCamera(const Text& what, const Text& where, const Text& hint = {});

/// Returns the bytes of a camera file. Throws Error (kInput).
std::vector<std::uint8_t> readCameraBytes(const std::filesystem::path& path);
std::string_view asText(std::span<const std::uint8_t> bytes);
/// Returns the content of a JSON camera file. Throws Error (kInput) if the file has more values
/// than kMostViews views need.
nlohmann::json readCameraJson(const std::filesystem::path& path);

/// Throws Error (kInput) unless there are 1 to kMostViews views.
void checkViewCount(std::uint64_t count, const std::string& where);

/// Returns a camera's matrix if it is rigid; otherwise throws Error (kInput).
const glm::dmat4& checkedPose(const glm::dmat4& matrix, const std::string& where);
/// Returns FileCamera::camera_to_world for a world-to-camera matrix in OpenCV's axes. Throws Error
/// (kInput) if the matrix is not rigid.
glm::dmat4 poseOfOpencv(const glm::dmat4& world_to_camera, const std::string& where);
/// Inverts poseOfOpencv(). The matrix must be rigid.
glm::dmat4 opencvOfPose(const glm::dmat4& camera_to_world);
/// Returns the inverse of a rigid matrix.
glm::dmat4 rigidInverse(const glm::dmat4& matrix);

/// Returns the intrinsics. Throws Error (kInput) unless all values are finite and the focal lengths
/// above 0.
Intrinsics checkedIntrinsics(const Intrinsics& intrinsics, const std::string& where);
/// Returns the intrinsics in a matrix K (row-major, in peeler's pixel coordinates). Throws Error
/// (kInput) if K has a skew or is not a matrix of intrinsics.
Intrinsics intrinsicsOfK(std::span<const double, 9> k, const std::string& where);
/// The error about a lens that the caller does not take.
struct LensRefusal {
    std::string what, where;
    const char* hint;
};
/// Returns FileCamera::lens: the lens of a model (findLensModel()) with these coefficients, or
/// nothing if it is a pinhole. Throws Error (kInput) if the coefficients have no meaning, or
/// `refusal` if the options do not take lenses.
std::optional<Lens> checkedLens(const CameraFileOptions& options, std::string_view model,
                                std::vector<double> coefficients, const LensRefusal& refusal);
/// Returns a picture's size. Throws Error (kInput) unless width and height are integers from 1 to
/// the limits.
Size checkedSize(double width, double height, const std::string& where);

/// Throws Error (kInput) unless the near plane lies in front of the eye and before the far plane.
void checkDepthPlanes(const FileCamera& camera, const std::string& where);

inline constexpr const char* kUndistort = "undistort the pictures first";

/// Returns the name of a picture's view: the picture's file name without folder and extension.
std::string viewName(const std::string& picture);

/// An object in a JSON camera file, with its place in the file: "file.json, /frames/3".
class CameraObject {
  public:
    /// `value` must outlive this object. Throws Error (kInput) if `value` is not a JSON object.
    CameraObject(const nlohmann::json& value, std::string file, std::string pointer);

    const nlohmann::json& value() const { return value_; }
    const std::string& pointer() const { return pointer_; }
    /// Returns the place of the object, or of a member, for messages.
    std::string where() const;
    std::string where(std::string_view key) const;

    /// Returns the member, or a null pointer if it is missing or JSON null.
    const nlohmann::json* find(const char* key) const;
    bool has(const char* key) const { return find(key) != nullptr; }
    /// Returns a finite number, or nothing if the member is missing. Throws Error (kInput) if the
    /// member is anything else.
    std::optional<double> number(const char* key) const;
    /// Returns the member's `count` finite numbers, if present.
    std::optional<std::vector<double>> numbers(const char* key, std::size_t count) const;
    /// Returns the member's `count` rows of `columns` numbers each, concatenated, if present.
    std::optional<std::vector<double>> rows(const char* key, std::size_t count,
                                            std::size_t columns) const;
    /// Returns an affine matrix, if present: 3 or 4 rows, the fourth 0, 0, 0, 1.
    std::optional<glm::dmat4> matrix(const char* key) const;
    std::optional<std::string> text(const char* key) const;
    /// Returns a required value. Throws Error (kInput), naming `key`, if it is missing.
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

/// Warns about each member of `object` whose key is not in `known`.
void warnOfOthers(const CameraObject& object, std::span<const std::string_view> known,
                  ReadWarnings& warnings);

/// Returns an affine matrix from its rows, 12 or 16 numbers. Throws Error (kInput) if a number is
/// not finite, or if the fourth row is not 0, 0, 0, 1.
glm::dmat4 matrixOfRows(std::span<const double> numbers, const std::string& where);

// Defined in camera_writing.cpp.

/// Returns the shortest text that reads back as the same number; keeps the sign of 0.
std::string cameraNumber(double number);
/// Returns the texts of numbers, joined by `separator`.
std::string cameraNumbers(std::span<const double> numbers, const char* separator = ", ");
/// Returns a text as a JSON string, with invalid UTF-8 replaced.
std::string jsonText(const std::string& text);
/// Returns the elements of a matrix's upper left block of this size, row by row.
std::vector<double> rowsOf(const glm::dmat4& matrix, int rows, int columns = 4);
/// Returns a camera's intrinsics for writing. Throws Error (kUsage) if the camera is orthographic
/// or its size is unknown.
Intrinsics writtenIntrinsics(const FileCamera& camera);
/// Throws Error (kUsage) if the camera is orthographic or has no size.
void checkWritten(const FileCamera& camera);
/// Throws Error (kUsage) about a lens that a format does not have.
[[noreturn]] void refuseLensOutput(const FileCamera& camera, const std::string& what);

}  // namespace peeler
