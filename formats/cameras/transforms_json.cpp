// SPDX-License-Identifier: Apache-2.0
// transforms.json of NeRF, instant-ngp and nerfstudio.
//
// https://docs.nerf.studio/quickstart/data_conventions.html
// https://github.com/NVlabs/instant-ngp/blob/master/docs/nerf_dataset_tips.md
//
// Pixel coordinates count from the upper left pixel's corner: instant-ngp (src/nerf_loader.cu,
// read_lens; pixels have their centre at + 0.5 in pixel_to_ray) and nerfstudio
// (Cameras.get_image_coords).
#include <algorithm>
#include <cmath>
#include <numbers>

#include <peeler/error.h>
#include "formats/cameras/camera_formats.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

constexpr const char* kNearKey = "peeler_near";  // peeler's own key; other programs ignore it
constexpr const char* kFarKey = "peeler_far";
// Written only if the view's name is not the picture's file name without folder and extension.
constexpr const char* kNameKey = "peeler_name";

/// Keys that need no warning, because they are read or do not affect the view (some affect
/// training, for instance).
constexpr std::string_view kKnownKeys[] = {
    "frames", "file_path", "transform_matrix", "w", "h", "fl_x", "fl_y", "cx", "cy",
    "camera_angle_x", "camera_angle_y", "x_fov", "y_fov", "camera_model", "k1", "k2", "k3", "k4",
    "k5", "k6", "p1", "p2", "p3", "p4", "s1", "s2", "distortion_params", "is_fisheye", "latlong",
    "equirectangular", "orthographic", "ftheta_p0", kNearKey, kFarKey, kNameKey,
    // Keys of instant-ngp.
    "aabb", "aabb_scale", "render_aabb", "scale", "offset", "up", "sharpness", "rotation",
    "sharpen", "white_transparent", "black_transparent", "is_hdr", "fix_premult",
    "n_extra_learnable_dims", "enable_depth_loading", "enable_ray_loading", "integer_depth_scale",
    "depth_path", "wants_importance_sampling", "driver_parameters",
    // Keys of nerfstudio.
    "depth_file_path", "mask_path", "semantics_path", "colmap_im_id", "ply_file_path",
    "train_filenames", "val_filenames", "test_filenames", "depth_unit_scale_factor",
    "fisheye_crop_radius", "orientation_override", "center_method_override",
    "auto_scale_poses_override"};

/// An unsupported key that affects the view, and the warning about it. The warning is left out if
/// the value, or every number of a list, is `neutral`, which has no effect.
struct PassedOver {
    const char* key;
    double neutral;
    const char* sentence;
};
constexpr PassedOver kPassedOver[] = {
    {"applied_scale", 1, "applied_scale is not undone: the cameras fit the scaled scene."},
    {"rolling_shutter", 0, "rolling_shutter is ignored: all rows see the same moment."},
    {"from_mitsuba", 0, "from_mitsuba is ignored: the matrices have NeRF's axes."},
    {"time", 0, "The times of frames are ignored: all show the scene at one time."},
    {"transform_matrix_start", NAN, "Cameras do not move: transform_matrix_start is ignored."},
    {"transform_matrix_end", NAN, "Cameras do not move: transform_matrix_end is ignored."},
};

void warnOfPassedOver(const CameraObject& holder, ReadWarnings& warnings) {
    std::vector<std::string_view> known(std::begin(kKnownKeys), std::end(kKnownKeys));
    for (const auto& [key, neutral, sentence] : kPassedOver) {
        known.emplace_back(key);
        const nlohmann::json* const value = holder.find(key);
        if (!value) continue;
        const auto says_nothing = [&, neutral = neutral](const nlohmann::json& number) {
            return number == neutral || number == (neutral != 0);
        };
        if (value->is_array() ? !std::ranges::all_of(*value, says_nothing) : !says_nothing(*value))
            warnings.warn(sentence, holder.where(key));
    }
    constexpr const char* kApplied = "applied_transform";
    known.emplace_back(kApplied);
    if (const auto applied = holder.matrix(kApplied); applied && *applied != glm::dmat4(1))
        warnings.warn("applied_transform is not undone: the cameras fit the transformed scene.",
                      holder.where(kApplied));
    warnOfOthers(holder, known, warnings);
}

/// The members of a frame. For members missing in the frame, the members of the whole file apply.
class FrameMembers {
  public:
    FrameMembers(const CameraObject& frame, const CameraObject& all) : frame_(frame), all_(all) {}

    const CameraObject& holder(const char* key) const { return frame_.has(key) ? frame_ : all_; }
    std::optional<double> number(const char* key) const { return holder(key).number(key); }
    std::string where(const char* key) const { return holder(key).where(key); }

  private:
    const CameraObject &frame_, &all_;
};

void checkLens(const CameraObject& holder) {
    constexpr const char* kCoefficients[] = {"k1", "k2", "k3", "k4", "k5", "k6",
                                             "p1", "p2", "p3", "p4", "s1", "s2"};
    constexpr const char* kOtherLenses[] = {"is_fisheye", "latlong", "equirectangular",
                                            "orthographic", "ftheta_p0"};
    constexpr const char* kPinholes[] = {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL",
                                         "OPENCV",  "FULL_OPENCV",    "PERSPECTIVE"};
    for (const char* key : kCoefficients)
        if (holder.number(key).value_or(0) != 0)
            refuseCamera(
                "lens distortion is not rendered, and \"" + std::string(key) + "\" is not 0",
                holder.where(key), kUndistort);
    if (const auto* const list = holder.find("distortion_params")) {
        const auto isZero = [](const nlohmann::json& k) { return k.is_number() && k == 0; };
        if (!list->is_array() || !std::ranges::all_of(*list, isZero))
            refuseCamera("lens distortion is not rendered, and one of these coefficients is not 0",
                         holder.where("distortion_params"), kUndistort);
    }
    for (const char* key : kOtherLenses)
        if (const auto* const value = holder.find(key); value && *value != false)
            refuseCamera(
                "only pinhole cameras are rendered, and this one has \"" + std::string(key) + "\"",
                holder.where(key), kUndistort);
    if (const auto model = holder.text("camera_model"))
        if (std::ranges::find(kPinholes, *model) == std::end(kPinholes))
            refuseCamera("only pinhole cameras are rendered, and this one has the model " + *model,
                         holder.where("camera_model"), kUndistort);
    for (const char* key : {"K", "intrinsic_matrix", "camera_intrinsics"})
        if (holder.has(key))
            refuseCamera("a matrix of intrinsics has no meaning in transforms.json",
                         holder.where(key), "give fl_x, fl_y, cx, cy, w and h, without a skew");
}

/// Returns the focal length, in pixels, along an axis ("x" or "y"). `pixels` is the picture's size
/// along this axis.
std::optional<double> focalLength(const FrameMembers& members, const std::string& axis,
                                  int pixels) {
    if (const auto length = members.number(("fl_" + axis).c_str())) return length;
    const std::pair<std::string, double> angles[] = {{"camera_angle_" + axis, 1},
                                                     {axis + "_fov", std::numbers::pi / 180}};
    for (const auto& [key, radians] : angles) {
        const auto field = members.number(key.c_str());
        if (!field) continue;
        const std::string where = members.where(key.c_str());
        const double angle = *field * radians;
        if (!(angle > 0 && angle < std::numbers::pi))
            refuseCamera("a field of view must lie between 0 and half a turn", where);
        if (pixels == 0)
            refuseCamera("a field of view needs \"w\" and \"h\" for the picture size", where,
                         "give " + Parameter::kSize);
        return pixels / (2 * std::tan(angle / 2));
    }
    return {};
}

void readLens(const FrameMembers& members, const CameraObject& frame, const Size& asked,
              FileCamera& camera) {
    const auto width = members.number("w"), height = members.number("h");
    if (width.has_value() != height.has_value())
        refuseCamera("a picture needs both \"w\" and \"h\", or neither", frame.where());
    camera.size = width ? checkedSize(*width, *height, members.where("w")) : asked;
    const int w = camera.size.width, h = camera.size.height;
    auto fx = focalLength(members, "x", w);
    auto fy = focalLength(members, "y", h);
    if (!fx && !fy) refuseCamera("\"fl_x\" and \"camera_angle_x\" are both missing", frame.where());
    if (!fx) fx = fy;  // square pixels unless both are given
    if (!fy) fy = fx;
    const auto centre = [&](const char* key, int pixels) {
        const auto corner = members.number(key);
        if (!corner && pixels == 0)
            refuseCamera("without \"w\" and \"h\" the centre of pictures is unknown, and \"" +
                             std::string(key) + "\" is missing",
                         frame.where(), "give " + Parameter::kSize);
        return corner.value_or(pixels / 2.0) - 0.5;
    };
    camera.intrinsics =
        checkedIntrinsics({*fx, *fy, centre("cx", w), centre("cy", h)}, frame.where());
}

std::vector<FileCamera> readTransforms(const CameraSource& source) {
    const CameraObject all(source.json(), source.path.string(), "");
    const nlohmann::json& frames = *all.find("frames");
    if (!frames.is_array())
        refuseCamera("expected a list of frames, not " + shownJson(frames), all.where("frames"));
    checkViewCount(frames.size(), all.where("frames"));
    checkLens(all);
    warnOfPassedOver(all, source.warnings);
    std::vector<FileCamera> cameras;
    cameras.reserve(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const CameraObject frame(frames[i], source.path.string(), childPointer("/frames", i));
        FileCamera& camera = cameras.emplace_back();
        camera.picture = frame.text("file_path").value_or("");
        camera.name = frame.text(kNameKey).value_or("");
        checkLens(frame);
        warnOfPassedOver(frame, source.warnings);
        readLens({frame, all}, frame, source.options.size, camera);
        constexpr const char* kMatrix = "transform_matrix";
        camera.camera_to_world =
            checkedPose(frame.required(frame.matrix(kMatrix), kMatrix), frame.where(kMatrix));
        camera.near = frame.number(kNearKey);
        camera.far = frame.number(kFarKey);
        checkDepthPlanes(camera, frame.where());
    }
    return cameras;
}

bool isTransforms(const CameraSource& source) {
    return lowerExtension(source.path) == ".json" && source.json().is_object() &&
           source.json().contains("frames") && !source.json()["frames"].is_null();
}

bool isTransformsName(const std::filesystem::path& path) {
    return lowerExtension(path) == ".json" && !path.filename().string().starts_with("scene_camera");
}

/// Returns the size and lens as the text of JSON members, each preceded by `before`.
std::string lensText(const FileCamera& camera, const char* before) {
    const Intrinsics lens = writtenIntrinsics(camera);
    const std::pair<const char*, double> members[] = {
        {"w", camera.size.width}, {"h", camera.size.height}, {"fl_x", lens.fx},
        {"fl_y", lens.fy},        {"cx", lens.cx + 0.5},     {"cy", lens.cy + 0.5}};
    std::string text;
    for (const auto& [key, value] : members)
        text += before + ('"' + std::string(key) + "\": ") + cameraNumber(value) + ",";
    return text;
}

std::string frameText(const FileCamera& camera, bool with_lens) {
    const std::string& picture = camera.picture.empty() ? camera.name : camera.picture;
    std::string text = "    {\"file_path\": " + jsonText(picture) + ",";
    if (viewName(picture) != camera.name)
        text += std::string(" \"") + kNameKey + "\": " + jsonText(camera.name) + ",";
    if (with_lens) text += lensText(camera, " ");
    if (camera.near)
        text += std::string(" \"") + kNearKey + "\": " + cameraNumber(*camera.near) + ",";
    if (camera.far) text += std::string(" \"") + kFarKey + "\": " + cameraNumber(*camera.far) + ",";
    text += "\n     \"transform_matrix\": [";
    const std::vector<double> numbers = rowsOf(camera.camera_to_world, 4);
    for (std::size_t row = 0; row < 4; ++row)
        text += (row ? ", [" : "[") + cameraNumbers(std::span(numbers).subspan(row * 4, 4)) + "]";
    return text + "]}";
}

std::vector<std::filesystem::path> transformsFile(const std::filesystem::path& path) {
    return {path};
}

std::vector<std::string> writeTransforms(const std::filesystem::path&,
                                         std::span<const FileCamera> cameras,
                                         const CameraOutputOptions&) {
    const bool shared = std::ranges::all_of(cameras, [&](const FileCamera& camera) {
        return camera.size == cameras.front().size &&
               writtenIntrinsics(camera) == writtenIntrinsics(cameras.front());
    });
    std::string text = "{\n  \"camera_model\": \"PINHOLE\",";
    if (shared) text += lensText(cameras.front(), "\n  ");
    text += "\n  \"frames\": [";
    for (const FileCamera& camera : cameras)
        text += (&camera == &cameras.front() ? "\n" : ",\n") + frameText(camera, !shared);
    return {text + "\n  ]\n}\n"};
}

}  // namespace

const CameraFormat kTransformsFormat = {"transforms.json", CameraConvention::kOpengl,
                                        isTransforms,      readTransforms,
                                        isTransformsName,  transformsFile,
                                        writeTransforms};

}  // namespace peeler
