// SPDX-License-Identifier: Apache-2.0
// COLMAP cameras: the files of a model, and conversion of their values.
// https://colmap.github.io/format.html, https://colmap.github.io/cameras.html
#include <algorithm>
#include <glm/gtc/quaternion.hpp>

#include <peeler/error.h>
#include "formats/cameras/camera_formats.h"
#include "formats/cameras/colmap_model.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

constexpr const char* kUndistorter =
    "undistort the pictures first: colmap image_undistorter makes PINHOLE cameras";

constexpr ColmapLens kColmapLenses[] = {
    {0, "SIMPLE_PINHOLE", 3, 1},
    {1, "PINHOLE", 4, 2},
    {2, "SIMPLE_RADIAL", 4, 1},
    {3, "RADIAL", 5, 1},
    {4, "OPENCV", 8, 2},
    {5, "OPENCV_FISHEYE", 8, 2},
    {6, "FULL_OPENCV", 12, 2},
    {7, "FOV", 5, 2},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, 1},
    {9, "RADIAL_FISHEYE", 5, 1},
    {10, "THIN_PRISM_FISHEYE", 12, 2},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, 2},
    {12, "SIMPLE_DIVISION", 4, 1},
    {13, "DIVISION", 5, 2},
    {14, "SIMPLE_FISHEYE", 3, 1},
    {15, "FISHEYE", 4, 2},
    {16, "EUCM", 6, 0},
    {17, "EQUIRECTANGULAR", 2, 0},
};

/// The folder of a model and the extension of its files: ".bin" or ".txt".
struct ModelFiles {
    std::filesystem::path folder;
    std::string extension;
};

constexpr std::string_view kModelStems[] = {"cameras", "images", "points3D"};

bool isModelFile(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    return (extension == ".bin" || extension == ".txt") &&
           std::ranges::find(kModelStems, path.stem().string()) != std::end(kModelStems);
}

bool isFolder(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

bool isColmap(const CameraSource& source) {
    return isFolder(source.path) || isModelFile(source.path);
}

/// Returns the model at a path. If a folder has binary files and text files, returns the binary
/// files, as COLMAP does.
ModelFiles modelAt(const std::filesystem::path& path) {
    if (!isFolder(path)) return {path.parent_path(), path.extension().string()};
    for (const char* extension : {".bin", ".txt"}) {
        if (fileExists(path / (std::string("cameras") + extension)) &&
            fileExists(path / (std::string("images") + extension)))
            return {path, extension};
    }
    refuseCamera("the folder holds no COLMAP model", path.string(),
                 "name the folder with cameras and images, .bin or .txt, often sparse/0; for other "
                 "formats, name the file");
}

std::vector<FileCamera> readColmap(const CameraSource& source) {
    const ModelFiles files = modelAt(source.path);
    const ColmapModel model = files.extension == ".bin"
                                  ? readColmapBinary(files.folder, source.options)
                                  : readColmapText(files.folder, source.options);
    const std::string where = (files.folder / ("images" + files.extension)).string();
    checkViewCount(model.images.size(), where);
    std::vector<FileCamera> cameras;
    cameras.reserve(model.images.size());
    for (std::size_t i = 0; i < model.images.size(); ++i) {
        const ColmapImage& image = model.images[i];
        const std::string place = where + ", image " + std::to_string(image.id);
        if (i > 0 && model.images[i - 1].id == image.id)
            refuseCamera("the image appears twice", place);
        const auto found = model.cameras.find(image.camera);
        if (found == model.cameras.end())
            refuseCamera("there is no camera " + std::to_string(image.camera), place);
        FileCamera& camera = cameras.emplace_back();
        camera.picture = image.name;
        camera.camera_to_world = image.camera_to_world;
        camera.intrinsics = found->second.intrinsics;
        camera.lens = found->second.lens;
        camera.size = found->second.size;
    }
    return cameras;
}

bool isColmapName(const std::filesystem::path& path) {
    return isModelFile(path) || isFolder(path) || !path.has_extension();
}

/// Returns the lens as one of COLMAP's models: OpenCV's coefficients k3 to k6 need FULL_OPENCV.
Lens lensForColmap(Lens lens) {
    std::vector<double>& k = lens.coefficients;
    if (lens.model != "opencv" || k.size() == 4) return lens;
    constexpr std::size_t kFull = 8;
    while (k.size() > kFull && k.back() == 0)
        k.pop_back();
    k.resize(std::max(k.size(), kFull));
    if (k.size() == kFull) lens.model = "full-opencv";
    return lens;
}

/// Returns a camera for writing. Throws Error (kUsage) if COLMAP has no such lens.
ColmapCamera writtenColmap(const FileCamera& camera) {
    checkWritten(camera);
    ColmapCamera written{{}, camera.size, {}};
    if (!camera.lens || !lensModel(*camera.lens).filling)
        written.intrinsics = writtenIntrinsics(camera);
    if (!camera.lens) return written;
    written.lens = lensForColmap(*camera.lens);
    const ColmapLens* const row = colmapParameters(written).lens;
    if (!row) refuseLensOutput(camera, "COLMAP has no lens like this " + camera.lens->model);
    if (row->focal_lengths == 1 && written.intrinsics->fx != written.intrinsics->fy)
        refuseLensOutput(camera, "COLMAP's " + std::string(row->name) +
                                     " has one focal length, but fx and fy differ");
    return written;
}

/// Returns a model of these cameras, with images numbered 1, 2, …. Views with the same lens,
/// intrinsics and size share a COLMAP camera.
ColmapModel modelOf(std::span<const FileCamera> cameras) {
    ColmapModel model;
    const auto key = [](const ColmapCamera& camera) {
        auto [lens, numbers] = colmapParameters(camera);
        for (const int number : {camera.size.width, camera.size.height, lens->id})
            numbers.push_back(number);
        return numbers;
    };
    std::map<std::vector<double>, std::uint32_t> ids;
    for (const FileCamera& camera : cameras) {
        const ColmapCamera lens = writtenColmap(camera);
        const auto next = static_cast<std::uint32_t>(ids.size() + 1);
        const std::uint32_t id = ids.try_emplace(key(lens), next).first->second;
        model.cameras.try_emplace(id, lens);
        ColmapImage& image = model.images.emplace_back();
        image.id = static_cast<std::uint32_t>(model.images.size());
        image.camera = id;
        image.name = camera.picture.empty() ? camera.name : camera.picture;
        image.camera_to_world = camera.camera_to_world;
        // In a text model, the name is the rest of the line, but older readers end the name at the
        // first space.
        const auto ends = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
        if (image.name.empty() || std::ranges::any_of(image.name, ends))
            throw Error(ErrorKind::kUsage, "a COLMAP name must not be empty or contain a space",
                        "camera \"" + image.name + "\"", "give it another name");
    }
    return model;
}

/// Returns the folder and extension of the model that is written to this path.
ModelFiles modelFor(const std::filesystem::path& path) {
    if (isModelFile(path) && !isFolder(path)) return {path.parent_path(), path.extension()};
    return {path, ".bin"};
}

std::vector<std::filesystem::path> colmapFiles(const std::filesystem::path& path) {
    const ModelFiles place = modelFor(path);
    std::vector<std::filesystem::path> files;
    for (const std::string_view stem : kModelStems)
        files.push_back(place.folder / (std::string(stem) + place.extension));
    return files;
}

std::vector<std::string> writeColmap(const std::filesystem::path& path,
                                     std::span<const FileCamera> cameras,
                                     const CameraOutputOptions& options) {
    const ModelFiles place = modelFor(path);
    const bool is_text = place.extension == ".txt";
    if (is_text && fileExists(place.folder / "cameras.bin", ErrorKind::kOutput))
        throw Error(ErrorKind::kUsage,
                    "the folder holds a binary model, which COLMAP would read instead",
                    place.folder.string(), "remove it, or write to another folder");
    const ColmapModel model = modelOf(cameras);
    ColmapFiles texts =
        is_text ? colmapText(model, options.points) : colmapBinary(model, options.points);
    return {std::move(texts.cameras), std::move(texts.images), std::move(texts.points)};
}

}  // namespace

const ColmapLens* colmapLens(int id) {
    const auto* const row = std::ranges::find(kColmapLenses, id, &ColmapLens::id);
    return row == std::end(kColmapLenses) ? nullptr : row;
}

const ColmapLens* colmapLens(std::string_view name) {
    const auto* const row = std::ranges::find(kColmapLenses, name, &ColmapLens::name);
    return row == std::end(kColmapLenses) ? nullptr : row;
}

ColmapCamera colmapCamera(const ColmapLens& lens, double width, double height,
                          std::span<const double> parameters, const CameraFileOptions& options,
                          const std::string& where) {
    const std::string name(lens.name);
    const std::string only_pinholes = "only pinhole cameras are rendered, and this is a " + name,
                      undistorted =
                          "lens distortion is not rendered, and this " + name + " has some";
    const LensModel* const model = findLensModel(name);
    const Size size = checkedSize(width, height, where);
    if (lens.focal_lengths == 0) {
        if (!model) refuseCamera(only_pinholes, where, kUndistorter);
        if (parameters[0] != width || parameters[1] != height)
            refuseCamera("the parameters of this " + name + " are not the picture's size", where);
        return {{}, size, checkedLens(options, name, {}, {only_pinholes, where, kUndistorter})};
    }
    const auto focal = static_cast<std::size_t>(lens.focal_lengths);
    const auto rest = parameters.subspan(focal + 2);
    ColmapCamera camera{checkedIntrinsics({parameters[0], parameters[focal - 1],
                                           parameters[focal] - 0.5, parameters[focal + 1] - 0.5},
                                          where),
                        size};
    if (model)
        camera.lens =
            checkedLens(options, name, {rest.begin(), rest.end()},
                        {model->perspective ? undistorted : only_pinholes, where, kUndistorter});
    else if (std::ranges::any_of(rest, [](double k) { return k != 0; }))
        refuseCamera(undistorted, where, kUndistorter);
    return camera;
}

ColmapParameters colmapParameters(const ColmapCamera& camera) {
    const ColmapLens* row = colmapLens("PINHOLE");
    std::vector<double> numbers;
    if (camera.lens) {
        const auto* const found = std::ranges::find_if(kColmapLenses, [&](const ColmapLens& lens) {
            const LensModel* const model = findLensModel(lens.name);
            return model && model->name == camera.lens->model;
        });
        if (found == std::end(kColmapLenses)) return {nullptr, {}};
        row = found;
        numbers = camera.lens->coefficients;
    }
    if (row->focal_lengths == 0)
        return {row, {double(camera.size.width), double(camera.size.height)}};
    const Intrinsics& k = *camera.intrinsics;
    std::vector<double> first{k.fx, k.fy, k.cx + 0.5, k.cy + 0.5};
    if (row->focal_lengths == 1) first.erase(first.begin() + 1);
    numbers.insert(numbers.begin(), first.begin(), first.end());
    const bool fits = numbers.size() == static_cast<std::size_t>(row->parameters);
    return {fits ? row : nullptr, numbers};
}

glm::dmat4 colmapPose(std::span<const double, 7> numbers, const std::string& where) {
    const glm::dquat turn(numbers[0], numbers[1], numbers[2], numbers[3]);
    const double length = glm::length(turn);  // need not be 1: COLMAP normalises it
    if (!(length > 0 && std::isfinite(length)))
        refuseCamera("the quaternion is 0 or not finite", where);
    glm::dmat4 world_to_camera(glm::mat3_cast(turn / length));
    for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(numbers[4 + static_cast<std::size_t>(i)]))
            refuseCamera("the translation is not finite", where);
        world_to_camera[3][i] = numbers[4 + static_cast<std::size_t>(i)];
    }
    return poseOfOpencv(world_to_camera, where);
}

std::array<double, 7> colmapNumbers(const glm::dmat4& camera_to_world) {
    const glm::dmat4 world_to_camera = opencvOfPose(camera_to_world);
    glm::dquat turn = glm::normalize(glm::quat_cast(glm::dmat3(world_to_camera)));
    if (turn.w < 0) turn = -turn;
    const glm::dvec4& shift = world_to_camera[3];
    return {turn.w, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z};
}

const CameraFormat kColmapFormat = {
    "a COLMAP model", CameraConvention::kOpencv, isColmap, readColmap, isColmapName, colmapFiles,
    writeColmap};

}  // namespace peeler
