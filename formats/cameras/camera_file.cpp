// SPDX-License-Identifier: Apache-2.0
// The table of camera file formats, and reading and writing steps that all formats share.
#include "formats/cameras/camera_file.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <peeler/error.h>
#include "core/base/names.h"
#include "core/scene/framing.h"
#include "core/scene/intrinsics.h"
#include "core/scene/view.h"
#include "formats/cameras/camera_formats.h"

namespace peeler {
namespace {

/// The formats in order of priority. The first format whose `holds` accepts a file reads the file.
/// The first format whose `written` accepts a name writes the file.
constexpr const CameraFormat* kCameraFormats[] = {
    &kTransformsFormat, &kBopFormat, &kCameraLinesFormat, &kPoseArrayFormat, &kColmapFormat,
};

constexpr CameraConventionInfo kConventions[] = {
    {"opencv", "world to camera; the camera looks along +Z, +Y down"},
    {"opengl", "camera to world; the camera looks along -Z, +Y up"},
    {"blender",
     "for a world with +Z up, which is turned to +Y up; the camera's axes are those of the file "
     "format or, if it defines none, those of opengl"},
};

std::string_view nameOf(CameraConvention convention) {
    return kConventions[static_cast<std::size_t>(convention)].name;
}

/// Throws Error (kUsage) if the options give a convention that contradicts that of the format.
void checkConvention(const CameraFormat& format, const CameraSource& source) {
    const auto asked = source.options.convention;
    if (!asked || asked == CameraConvention::kBlender || &format == &kPoseArrayFormat) return;
    if (asked == format.convention) return;
    const std::string own = format.convention
                                ? "its cameras use " + std::string(nameOf(*format.convention))
                                : "its keys define the axes of a camera";
    throw Error(ErrorKind::kUsage,
                "the convention " + std::string(nameOf(*asked)) + " is not that of " + format.name +
                    ": " + own,
                source.path.string(), "leave it out, or give blender for a world with +Z up");
}

/// Rotates a camera and its objects from a world with +Z up to a world with +Y up.
void turnWorld(FileCamera& camera) {
    const auto turn = [](glm::dmat4& to_world) {
        for (int column = 0; column < 4; ++column) {
            const glm::dvec4 v = to_world[column];
            to_world[column] = {v.x, v.z, 0.0 - v.y, v.w};
        }
    };
    turn(camera.camera_to_world);
    for (PlacedObject& object : camera.objects)
        turn(object.to_world);
}

/// Throws Error (kInput) if the camera cannot become a view. Otherwise, rendering would fail later.
void checkRenderable(const FileCamera& camera, const std::string& where) {
    if (!camera.intrinsics || camera.lens || camera.size.height == 0) return;
    View view;
    view.width = camera.size.width;
    view.height = camera.size.height;
    try {
        setIntrinsics(view, *camera.intrinsics);
    } catch (const Error& error) {
        refuseCamera(error.whatText(), where + ", view " + camera.name, error.hintText());
    }
}

const CameraFormat& outputFormatOf(const std::string& path) {
    const bool is_folder = path.ends_with('/');
    for (const CameraFormat* format : kCameraFormats)
        if (format->write && !path.empty() && (!is_folder || format == &kColmapFormat) &&
            (is_folder || format->written(path)))
            return *format;
    throw Error(
        ErrorKind::kUsage, "unknown camera format to write", path,
        "give transforms.json, scene_camera.json (BOP), a folder for COLMAP's binary files, "
        "or its cameras.txt for text");
}

}  // namespace

const nlohmann::json& CameraSource::json() const {
    if (!json_) json_ = std::make_shared<const nlohmann::json>(readCameraJson(path));
    return *json_;
}

std::span<const CameraConventionInfo> cameraConventions() {
    return kConventions;
}

CameraConvention cameraConvention(const std::string& name) {
    const auto* const found = std::ranges::find(kConventions, name, &CameraConventionInfo::name);
    if (found != std::end(kConventions))
        return static_cast<CameraConvention>(found - std::begin(kConventions));
    std::vector<std::string_view> names;
    for (const CameraConventionInfo& row : kConventions)
        names.push_back(row.name);
    throw Error(ErrorKind::kUsage, "unknown camera convention", name,
                choiceHint(name, "conventions", names));
}

std::vector<FileCamera> readCameras(const std::filesystem::path& path,
                                    const CameraFileOptions& options, ReadWarnings& warnings) {
    const CameraSource source(path, options, warnings);
    const auto* const format = std::ranges::find_if(
        kCameraFormats, [&](const CameraFormat* row) { return row->holds(source); });
    if (format == std::end(kCameraFormats)) {
        readCameraBytes(path);  // throws if the file is missing
        refuseCamera("unknown camera format", path.string(),
                     "give transforms.json with \"frames\", BOP's scene_camera.json, a COLMAP "
                     "folder, .npy or .npz, or .jsonl");
    }
    checkConvention(**format, source);
    std::vector<FileCamera> cameras = (*format)->read(source);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        FileCamera& camera = cameras[i];
        if (camera.name.empty()) camera.name = viewName(camera.picture);
        if (camera.name.empty()) camera.name = std::to_string(i);
        if (options.convention == CameraConvention::kBlender) turnWorld(camera);
        checkRenderable(camera, path.string());
    }
    return cameras;
}

namespace {

/// Returns a view's lens, or nothing for a pinhole. Throws Error (kUsage) if it cannot be stored.
std::optional<Lens> storedLens(const View& view) {
    if (!view.rays) return {};
    const LensCamera* const camera = lensCameraOf(view);
    if (!camera)
        throw Error(ErrorKind::kUsage,
                    "a moving camera or a list of rays cannot be written as a camera",
                    view.camera_name);
    const bool whole = view.crop == Window{0, 0, view.width, view.height};
    if (lensModel(camera->lens).filling && !whole)
        throw Error(ErrorKind::kUsage, "a part of a picture of all directions is no camera",
                    view.camera_name, "leave out " + Parameter::kCrop);
    return camera->lens;
}

}  // namespace

FileCamera fileCamera(const View& view, std::string name) {
    FileCamera camera;
    camera.name = std::move(name);
    camera.camera_to_world = view.camera_to_world;
    const Projection& projection = view.projection;
    camera.lens = storedLens(view);
    const bool fills = camera.lens && lensModel(*camera.lens).filling;
    if (projection.perspective && !fills) camera.intrinsics = intrinsicsOf(view);
    if (!projection.perspective)
        camera.ortho_height = 2 * projection.half_height * view.crop.height() / view.height;
    // Distances along the rays of a lens begin at 0 by default, but formats need a near plane.
    if (!view.rays || projection.near > 0) camera.near = projection.near;
    if (std::isfinite(projection.far)) camera.far = projection.far;
    camera.size = {view.crop.width(), view.crop.height()};
    return camera;
}

CameraChoice cameraChoice(const FileCamera& camera, CameraChoice choice) {
    choice.pose = camera.camera_to_world;
    if (camera.intrinsics) choice.intrinsics = camera.intrinsics;
    if (camera.lens) choice.lens = camera.lens;
    if (camera.fov) choice.fov = camera.fov;
    if (camera.ortho_height) choice.ortho_height = camera.ortho_height;
    if (camera.near) choice.near = camera.near;
    if (camera.far) choice.far = camera.far;
    if (camera.size.width > 0) choice.size = camera.size;
    if ((camera.intrinsics || camera.lens) && camera.size.width == 0)
        throw Error(ErrorKind::kUsage, "the file gives no picture size", "camera " + camera.name,
                    "give " + Parameter::kSize);
    return choice;
}

bool holdsScenePoints(const std::string& path) {
    return &outputFormatOf(path) == &kColmapFormat;
}

void checkCameraOutput(const std::string& path) {
    outputFormatOf(path);
}

std::vector<std::filesystem::path> cameraFiles(const std::filesystem::path& path) {
    for (const CameraFormat* format : kCameraFormats)
        if (format->files && format->written(path)) return format->files(path);
    return {path};
}

void writeCameras(const std::string& path, std::span<const FileCamera> cameras,
                  const CameraOutputOptions& options) {
    const CameraFormat& format = outputFormatOf(path);
    if (cameras.empty()) throw Error(ErrorKind::kUsage, "there are no cameras to write", path);
    const std::vector<std::string> texts = format.write(path, cameras, options);
    const std::vector<std::filesystem::path> names = format.files(path);
    std::vector<std::unique_ptr<AtomicFile>> files;
    for (std::size_t i = 0; i < texts.size(); ++i) {
        files.push_back(std::make_unique<AtomicFile>(names[i].string()));
        files.back()->append(std::as_bytes(std::span(texts[i])));
    }
    commitAll(files);
}

}  // namespace peeler
