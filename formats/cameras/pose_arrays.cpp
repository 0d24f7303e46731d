// SPDX-License-Identifier: Apache-2.0
// Pose files of NumPy: one array (.npy), or several named arrays (.npz).
#include <algorithm>
#include <array>

#include <peeler/error.h>
#include "formats/arrays/array_reader.h"
#include "formats/cameras/camera_formats.h"
#include "formats/file/file_name.h"

namespace peeler {
namespace {

enum class PoseDirection { kUnknown, kToCamera, kToWorld };

/// A possible name of the pose array in an archive. The first name present is used.
struct PoseArray {
    const char* name;
    PoseDirection direction;
    /// The convention that the name implies; an explicit convention overrides it.
    std::optional<CameraConvention> convention;
};
constexpr PoseArray kPoseArrays[] = {
    {"poses", PoseDirection::kUnknown, {}},
    {"world_to_camera", PoseDirection::kToCamera, CameraConvention::kOpencv},
    {"w2c", PoseDirection::kToCamera, CameraConvention::kOpencv},
    {"extrinsics", PoseDirection::kToCamera, CameraConvention::kOpencv},
    {"camera_to_world", PoseDirection::kToWorld, {}},
    {"c2w", PoseDirection::kToWorld, {}},
};

/// An array with one item per view, or with a single item that all views share.
class ThingArray {
  public:
    /// `lengths` is the shape of an item.
    ThingArray(NumberArray array, std::string where, const std::vector<std::uint64_t>& lengths,
               const std::string& expected)
        : array_(std::move(array)), where_(std::move(where)) {
        const auto& shape = array_.shape;
        is_one_ = shape.size() == lengths.size();
        const std::size_t first = is_one_ ? 0 : 1;
        bool fits = shape.size() == lengths.size() + first;
        for (std::size_t i = 0; fits && i < lengths.size(); ++i) {
            // A matrix of three rows of four numbers may have a fourth row.
            const bool is_rows = lengths == std::vector<std::uint64_t>{3, 4} && i == 0;
            fits = shape[i + first] == lengths[i] || (is_rows && shape[first] == 4);
        }
        if (!fits) refuseCamera("the array's shape is not " + expected, where_);
        size_ = 1;
        for (std::size_t i = first; i < shape.size(); ++i)
            size_ *= shape[i];
        count_ = is_one_ ? 1 : shape[0];
    }

    bool isOne() const { return is_one_; }
    std::uint64_t count() const { return count_; }
    /// Returns the numbers of a view's item, in C order.
    std::vector<double> operator[](std::uint64_t index) const {
        std::vector<double> numbers;
        for (std::uint64_t i = 0; i < size_; ++i)
            numbers.push_back(array_.at((is_one_ ? 0 : index) * size_ + i));
        return numbers;
    }
    std::string where(std::uint64_t index) const {
        return is_one_ ? where_ : where_ + "[" + std::to_string(index) + "]";
    }
    /// Throws Error (kInput) unless the array has a single item, or one per view.
    void checkCount(std::uint64_t views) const {
        if (!is_one_ && count_ != views)
            refuseCamera("the array has " + std::to_string(count_) + " entries, but there are " +
                             std::to_string(views) + " poses",
                         where_);
    }

  private:
    NumberArray array_;
    std::string where_;
    bool is_one_ = false;
    std::uint64_t size_ = 0, count_ = 0;
};

/// Returns the camera-to-world matrix in glTF's axes for a matrix from a file.
glm::dmat4 poseOf(const glm::dmat4& matrix, PoseDirection direction, CameraConvention convention,
                  const std::string& where) {
    const bool is_opencv = convention == CameraConvention::kOpencv;
    if (direction == PoseDirection::kUnknown)
        direction = is_opencv ? PoseDirection::kToCamera : PoseDirection::kToWorld;
    checkedPose(matrix, where);
    if (!is_opencv) return direction == PoseDirection::kToWorld ? matrix : rigidInverse(matrix);
    return direction == PoseDirection::kToCamera ? poseOfOpencv(matrix, where)
                                                 : rigidInverse(opencvOfPose(matrix));
}

std::vector<FileCamera> camerasOf(const ThingArray& poses, const PoseArray& kind,
                                  const CameraSource& source) {
    const auto convention = source.options.convention ? source.options.convention : kind.convention;
    if (!convention)
        throw Error(
            ErrorKind::kUsage, "an array of poses needs a convention for its axes",
            source.path.string(),
            "give " + Parameter::kConvention +
                ": opencv is world to camera, looking along +Z with +Y down; "
                "opengl is camera to "
                "world, looking along -Z with +Y up; blender is like opengl, in a world with +Z "
                "up");
    checkViewCount(poses.count(), source.path.string());
    std::vector<FileCamera> cameras(poses.count());
    for (std::uint64_t i = 0; i < poses.count(); ++i) {
        cameras[i].size = source.options.size;
        cameras[i].camera_to_world = poseOf(matrixOfRows(poses[i], poses.where(i)), kind.direction,
                                            *convention, poses.where(i));
    }
    return cameras;
}

ThingArray posesIn(const std::optional<NumberArray>& array, const std::string& where) {
    if (!array) refuseCamera("expected an array of numbers", where, "numpy.save(path, poses)");
    return {*array, where, {3, 4}, "(n, 3, 4) or (n, 4, 4), or one such matrix"};
}

/// An array in an archive, if present.
class ArchivedThings {
  public:
    ArchivedThings(const NpzArchive& archive, const char* name) {
        const NpzArchive::Member* const member = archive.find(name);
        if (!member) return;
        where_ = archive.placeOf(*member);
        // Check the decompressed size, too, because the size limit of camera files does not cover
        // it.
        if (member->size > kMostCameraBytes) refuseCamera("the array is too large", where_);
        array_ = npyArray(archive.contents(*member, storage_), where_);
        if (!array_) refuseCamera("expected an array of numbers", where_);
        is_there_ = true;
    }
    ArchivedThings(const ArchivedThings&) = delete;
    ArchivedThings& operator=(const ArchivedThings&) = delete;

    explicit operator bool() const { return is_there_; }
    const std::optional<NumberArray>& array() const { return array_; }
    const std::string& where() const { return where_; }

  private:
    bool is_there_ = false;
    std::string where_;
    std::vector<std::uint8_t> storage_;
    std::optional<NumberArray> array_;
};

std::vector<FileCamera> camerasIn(const NpzArchive& archive, const CameraSource& source) {
    const auto* const kind = std::ranges::find_if(
        kPoseArrays, [&](const PoseArray& row) { return archive.find(row.name) != nullptr; });
    if (kind == std::end(kPoseArrays)) {
        std::string names;
        for (const PoseArray& row : kPoseArrays)
            names += (names.empty() ? "" : ", ") + std::string(row.name);
        refuseCamera("the file has no array of poses", source.path.string(),
                     "name the array one of " + names);
    }
    for (const NpzArchive::Member& member : archive.members()) {
        const std::string name = std::filesystem::path(member.name).stem();
        const std::string_view known[] = {kind->name, "K", "size", "arrays_version"};
        if (std::ranges::find(known, name) == std::end(known))
            source.warnings.warn("The array " + name + " is ignored.", archive.placeOf(member));
    }
    const ArchivedThings matrices(archive, kind->name);
    const ThingArray poses = posesIn(matrices.array(), matrices.where());
    std::vector<FileCamera> cameras = camerasOf(poses, *kind, source);
    if (const ArchivedThings found(archive, "K"); found) {
        const ThingArray lenses(*found.array(), found.where(), {3, 3}, "(3, 3) or (n, 3, 3)");
        lenses.checkCount(cameras.size());
        for (std::uint64_t i = 0; i < cameras.size(); ++i) {
            const std::vector<double> k = lenses[i];
            cameras[i].intrinsics =
                intrinsicsOfK(std::span<const double, 9>(k.data(), 9), lenses.where(i));
        }
    }
    if (const ArchivedThings found(archive, "size"); found) {
        const ThingArray sizes(*found.array(), found.where(), {2}, "(2,) or (n, 2)");
        sizes.checkCount(cameras.size());
        for (std::uint64_t i = 0; i < cameras.size(); ++i)
            cameras[i].size = checkedSize(sizes[i][0], sizes[i][1], sizes.where(i));
    }
    return cameras;
}

std::vector<FileCamera> readPoseArrays(const CameraSource& source) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(source.path);
    const std::string where = source.path.string();
    if (lowerExtension(source.path) == ".npz") return camerasIn(NpzArchive(bytes, where), source);
    return camerasOf(posesIn(npyArray(bytes, where), where), kPoseArrays[0], source);
}

bool isPoseArray(const CameraSource& source) {
    const std::string extension = lowerExtension(source.path);
    return extension == ".npy" || extension == ".npz";
}

}  // namespace

const CameraFormat kPoseArrayFormat = {
    "an array of poses", {}, isPoseArray, readPoseArrays, nullptr, nullptr, nullptr};

}  // namespace peeler
