// SPDX-License-Identifier: Apache-2.0
// BOP scene cameras: scene_camera.json, with scene_gt.json and camera.json.
// https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md The pixel
// coordinates (0, 0) mean the centre of the upper left pixel, as in the toolkit's
// misc.depth_im_to_dist_im().
#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>

#include <peeler/error.h>
#include "formats/cameras/bop_lens.h"
#include "formats/cameras/camera_formats.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

constexpr double kMillimetres = 1000;
constexpr std::string_view kSceneCamera = "scene_camera";

// Keys that need no warning, because they are read or do not affect the view.
constexpr std::string_view kPictureKeys[] = {"cam_K",       "cam_R_w2c",  "cam_t_w2c",
                                             "depth_scale", "view_level", "mode"};
constexpr std::string_view kCameraKeys[] = {"width", "height", "fx",         "fy",
                                            "cx",    "cy",     "depth_scale"};
constexpr std::string_view kLensPictureKeys[] = {"cam_model",   "cam_R_w2c",  "cam_t_w2c",
                                                 "depth_scale", "view_level", "mode"};
constexpr std::string_view kObjectKeys[] = {"obj_id", "cam_R_m2c", "cam_t_m2c"};

/// Returns the path of the file `name` that accompanies the camera file `path`. `folder` is
/// relative to the camera file's folder. Datasets with several sensors have
/// scene_camera_SENSOR.json, and so on.
std::filesystem::path companion(const std::filesystem::path& path, const std::string& folder,
                                const std::string& name) {
    const std::string stem = path.stem().string();
    const std::string sensor =
        stem.starts_with(kSceneCamera) ? stem.substr(kSceneCamera.size()) : "";
    return path.parent_path() / folder / (name + sensor + ".json");
}

/// Returns the rigid matrix given by two members: a rotation (row by row) and a translation
/// (millimetres).
glm::dmat4 rigidMembers(const CameraObject& object, const char* turn, const char* shift) {
    const std::array<double, 9> identity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const auto rotation = object.numbers(turn, 9);
    const auto translation = object.numbers(shift, 3);
    glm::dmat4 matrix(1);
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column)
            matrix[static_cast<int>(column)][static_cast<int>(row)] =
                rotation ? (*rotation)[row * 3 + column] : identity[row * 3 + column];
        if (translation) matrix[3][static_cast<int>(row)] = (*translation)[row] / kMillimetres;
    }
    return checkedPose(matrix, object.where(turn));
}

/// Returns the key as a picture's id, or nothing if it is not a number.
std::optional<std::uint32_t> pictureId(const std::string& key) {
    std::uint32_t id = 0;
    const auto [end, failure] = std::from_chars(key.data(), key.data() + key.size(), id);
    if (failure != std::errc() || end != key.data() + key.size()) return {};
    return id;
}

/// Returns the name of a picture's file without its extension: "000017".
std::string pictureName(std::uint32_t id) {
    const std::string digits = std::to_string(id);
    return std::string(6 - std::min<std::size_t>(digits.size(), 6), '0') + digits;
}

/// Returns the picture ids in a file with their members, ordered by id.
std::vector<std::pair<std::uint32_t, const nlohmann::json*>> picturesIn(const nlohmann::json& root,
                                                                        const std::string& where) {
    std::vector<std::pair<std::uint32_t, const nlohmann::json*>> pictures;
    for (const auto& [key, value] : root.items()) {
        const auto id = pictureId(key);
        if (!id) refuseCamera("\"" + key + "\" is not the number of a picture", where);
        pictures.emplace_back(*id, &value);
    }
    std::ranges::sort(pictures, {}, [](const auto& picture) { return picture.first; });
    for (std::size_t i = 1; i < pictures.size(); ++i)
        if (pictures[i].first == pictures[i - 1].first)
            refuseCamera("picture " + std::to_string(pictures[i].first) + " appears twice", where);
    return pictures;
}

/// Returns the size of the pictures from a camera.json in the camera file's folder or in the two
/// folders above it.
Size sizeBeside(const CameraSource& source) {
    for (const char* folder : {".", "..", "../.."}) {
        for (const auto& path : {companion(source.path, folder, "camera"),
                                 source.path.parent_path() / folder / "camera.json"}) {
            if (!isSeen(path)) continue;  // false in unreadable folders
            const nlohmann::json root = readCameraJson(path);
            const CameraObject camera(root, path.lexically_normal().string(), "");
            warnOfOthers(camera, kCameraKeys, source.warnings);
            const auto width = camera.number("width"), height = camera.number("height");
            return checkedSize(camera.required(width, "width"), camera.required(height, "height"),
                               camera.where());
        }
    }
    return source.options.size;
}

/// Returns the objects in a picture's list, placed in world space. `pose` is the picture's camera.
std::vector<PlacedObject> objectsIn(const nlohmann::json& list, const std::string& file,
                                    const std::string& pointer, const glm::dmat4& pose,
                                    ReadWarnings& warnings) {
    if (!list.is_array())
        refuseCamera("expected a list of objects, not " + shownJson(list), file + ", " + pointer);
    const glm::dmat4 camera_to_world = rigidInverse(opencvOfPose(pose));
    std::vector<PlacedObject> objects;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const CameraObject object(list[i], file, childPointer(pointer, i));
        warnOfOthers(object, kObjectKeys, warnings);
        const double id = object.required(object.number("obj_id"), "obj_id");
        if (!(id >= 0 && id <= 1e9) || id != static_cast<int>(id))
            refuseCamera("an object's id must be a whole number", object.where("obj_id"));
        for (const char* key : {"cam_R_m2c", "cam_t_m2c"})
            object.required(object.has(key) ? std::optional(true) : std::nullopt, key);
        objects.push_back({static_cast<int>(id),
                           camera_to_world * rigidMembers(object, "cam_R_m2c", "cam_t_m2c")});
    }
    return objects;
}

/// Reads a picture's cam_model.
void readLens(const CameraObject& picture, const CameraSource& source, FileCamera& camera) {
    const std::string where = picture.where("cam_model");
    const nlohmann::json& model = picture.value().at("cam_model");
    const LensRefusal refusal = {
        "only pinhole cameras are rendered, and this camera model has lens distortion", where,
        kUndistort};
    if (!source.options.lenses) refuseCamera(refusal.what, where, kUndistort);
    if (!model.is_object() ||
        model.value("projection_model_type", nlohmann::json()) != kBopLensType)
        refuseCamera("this camera model is not " + std::string(kBopLensType), where);
    const CameraObject lens(model, source.path.string(), picture.pointer() + "/cam_model");
    // Aria's recordings have one focal length.
    const bool one_focal =
        model.contains("projection_params") && model["projection_params"].size() == 15;
    auto numbers =
        lens.required(lens.numbers("projection_params", one_focal ? 15 : 16), "projection_params");
    if (one_focal) numbers.insert(numbers.begin(), numbers.front());
    camera.intrinsics = checkedIntrinsics({numbers[0], numbers[1], numbers[2], numbers[3]}, where);
    camera.lens =
        checkedLens(source.options, "fisheye624", {numbers.begin() + 4, numbers.end()}, refusal);
    camera.size = checkedSize(lens.required(lens.number("image_width"), "image_width"),
                              lens.required(lens.number("image_height"), "image_height"), where);
}

std::vector<FileCamera> readBop(const CameraSource& source) {
    const std::string file = source.path.string();
    const auto pictures = picturesIn(source.json(), file);
    checkViewCount(pictures.size(), file);
    const Size size = sizeBeside(source);

    const std::filesystem::path poses = companion(source.path, "", "scene_gt");
    nlohmann::json placed = nlohmann::json::object();
    if (poses != source.path && fileExists(poses)) placed = readCameraJson(poses);
    std::map<std::uint32_t, const nlohmann::json*> lists;
    for (const auto& [id, list] :
         picturesIn(CameraObject(placed, poses.string(), "").value(), poses.string()))
        lists.emplace(id, list);

    std::vector<FileCamera> cameras;
    cameras.reserve(pictures.size());
    for (const auto& [id, value] : pictures) {
        const std::string key = std::to_string(id);
        const CameraObject picture(*value, file, childPointer("", key));
        FileCamera& camera = cameras.emplace_back();
        camera.name = pictureName(id);
        camera.size = size;
        if (picture.has("cam_model")) {
            warnOfOthers(picture, kLensPictureKeys, source.warnings);
            readLens(picture, source, camera);
        } else {
            warnOfOthers(picture, kPictureKeys, source.warnings);
            const auto k = picture.required(picture.numbers("cam_K", 9), "cam_K");
            camera.intrinsics =
                intrinsicsOfK(std::span<const double, 9>(k.data(), 9), picture.where("cam_K"));
        }
        camera.camera_to_world = poseOfOpencv(rigidMembers(picture, "cam_R_w2c", "cam_t_w2c"),
                                              picture.where("cam_R_w2c"));
        const auto list = lists.extract(id);
        if (list)
            camera.objects = objectsIn(*list.mapped(), poses.string(), childPointer("", key),
                                       camera.camera_to_world, source.warnings);
    }
    for (const auto& [id, list] : lists)
        if (!list->empty())
            source.warnings.warn(
                "The objects of picture " + std::to_string(id) + " are ignored: it has no camera.",
                poses.string());
    return cameras;
}

bool isBop(const CameraSource& source) {
    if (lowerExtension(source.path) != ".json" || !source.json().is_object()) return false;
    return !source.json().empty() &&
           std::ranges::all_of(source.json().items(), [](const auto& member) {
               return pictureId(member.key()) && member.value().is_object();
           });
}

bool isBopName(const std::filesystem::path& path) {
    return lowerExtension(path) == ".json" && path.filename().string().starts_with(kSceneCamera);
}

/// Returns the JSON text of two members: rotation, and translation in millimetres.
std::string rigidText(const glm::dmat4& matrix, const std::string& names) {
    const glm::dvec3 shift = glm::dvec3(matrix[3]) * kMillimetres;
    return "\"cam_R_" + names + "\": [" + cameraNumbers(rowsOf(matrix, 3, 3)) + "], \"cam_t_" +
           names + "\": [" + cameraNumbers(std::array{shift.x, shift.y, shift.z}) + "]";
}

/// Returns the JSON text of a picture's objects relative to its camera, as in scene_gt.json.
std::string objectsText(const FileCamera& camera) {
    const glm::dmat4 world_to_camera = opencvOfPose(camera.camera_to_world);
    std::string text;
    for (const PlacedObject& object : camera.objects)
        text += (text.empty() ? "{" : ", {") + rigidText(world_to_camera * object.to_world, "m2c") +
                ", \"obj_id\": " + std::to_string(object.id) + "}";
    return "[" + text + "]";
}

/// Returns the cameras' names as picture ids if the names are different numbers. Otherwise returns
/// 0, 1, ….
std::vector<std::uint32_t> idsOf(std::span<const FileCamera> cameras) {
    std::vector<std::uint32_t> ids;
    std::set<std::uint32_t> different;
    for (const FileCamera& camera : cameras)
        if (const auto id = pictureId(camera.name); id && different.insert(*id).second)
            ids.push_back(*id);
    if (ids.size() == cameras.size()) return ids;
    ids.clear();
    for (std::size_t i = 0; i < cameras.size(); ++i)
        ids.push_back(static_cast<std::uint32_t>(i));
    return ids;
}

std::vector<std::filesystem::path> bopFiles(const std::filesystem::path& path) {
    return {path, companion(path, "", "camera"), companion(path, "", "scene_gt")};
}

std::vector<std::string> writeBop(const std::filesystem::path&, std::span<const FileCamera> cameras,
                                  const CameraOutputOptions& options) {
    const FileCamera& first = cameras.front();
    const std::vector<std::uint32_t> ids = idsOf(cameras);
    const std::string scale = ", \"depth_scale\": " + cameraNumber(options.depth_scale);
    const auto all = [&](const auto& value) {
        std::string text;
        for (std::size_t i = 0; i < cameras.size(); ++i)
            text +=
                (i ? ",\n  \"" : "{\n  \"") + std::to_string(ids[i]) + "\": " + value(cameras[i]);
        return text + "\n}\n";
    };
    const std::string scene = all([&](const FileCamera& camera) {
        if (camera.lens)
            refuseLensOutput(camera,
                             "BOP has no lenses, and this camera has " + camera.lens->model);
        const Intrinsics k = writtenIntrinsics(camera);
        if (camera.size != first.size)
            throw Error(ErrorKind::kUsage, "BOP needs the same size for all pictures",
                        "camera " + camera.name, "write transforms.json, or a file for each size");
        const std::array<double, 9> numbers = {k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1};
        return "{\"cam_K\": [" + cameraNumbers(numbers) + "], " +
               rigidText(opencvOfPose(camera.camera_to_world), "w2c") + scale + "}";
    });
    const Intrinsics k = writtenIntrinsics(first);
    std::vector<std::string> texts = {
        scene, "{\"cx\": " + cameraNumber(k.cx) + ", \"cy\": " + cameraNumber(k.cy) + scale +
                   ", \"fx\": " + cameraNumber(k.fx) + ", \"fy\": " + cameraNumber(k.fy) +
                   ", \"height\": " + std::to_string(first.size.height) +
                   ", \"width\": " + std::to_string(first.size.width) + "}\n"};
    if (!std::ranges::all_of(cameras, [](const auto& camera) { return camera.objects.empty(); }))
        texts.push_back(all(objectsText));
    return texts;
}

}  // namespace

const CameraFormat kBopFormat = {"BOP's scene_camera.json",
                                 CameraConvention::kOpencv,
                                 isBop,
                                 readBop,
                                 isBopName,
                                 bopFiles,
                                 writeBop};

}  // namespace peeler
