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
#include <array>
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
    "equirectangular", "orthographic", "ftheta_p0", "ftheta_p1", "ftheta_p2", "ftheta_p3",
    "ftheta_p4", kNearKey, kFarKey, kNameKey,
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

void checkMatrices(const CameraObject& holder) {
    for (const char* key : {"K", "intrinsic_matrix", "camera_intrinsics"})
        if (holder.has(key))
            refuseCamera("a matrix of intrinsics has no meaning in transforms.json",
                         holder.where(key), "give fl_x, fl_y, cx, cy, w and h, without a skew");
}

/// Returns the error about a lens that is no pinhole.
LensRefusal noPinhole(const FrameMembers& members, const char* key) {
    return {"only pinhole cameras are rendered, and this one has \"" + std::string(key) + "\"",
            members.where(key), kUndistort};
}
LensRefusal noPinholeModel(const FrameMembers& members) {
    return {"only pinhole cameras are rendered, and this one has the model " +
                members.holder("camera_model").text("camera_model").value_or(""),
            members.where("camera_model"), kUndistort};
}
[[noreturn]] void refuseLens(const LensRefusal& refusal) {
    refuseCamera(refusal.what, refusal.where, refusal.hint);
}

/// The coefficients of a frame's lens, and the error about the first that is not 0.
struct LensCoefficients {
    std::array<double, 6> k{};
    double p1 = 0, p2 = 0;
    LensRefusal refusal{};
};
LensCoefficients coefficientsIn(const FrameMembers& members) {
    LensCoefficients lens;
    const std::pair<const char*, double*> taken[] = {
        {"k1", &lens.k[0]}, {"k2", &lens.k[1]}, {"k3", &lens.k[2]}, {"k4", &lens.k[3]},
        {"k5", &lens.k[4]}, {"k6", &lens.k[5]}, {"p1", &lens.p1},   {"p2", &lens.p2}};
    const auto refusalOf = [&](const char* key) {
        return LensRefusal{
            "lens distortion is not rendered, and \"" + std::string(key) + "\" is not 0",
            members.where(key), kUndistort};
    };
    for (const auto& [key, value] : taken) {
        *value = members.number(key).value_or(0);
        if (*value != 0 && lens.refusal.what.empty()) lens.refusal = refusalOf(key);
    }
    for (const char* key : {"p3", "p4", "s1", "s2"})
        if (members.number(key).value_or(0) != 0) refuseLens(refusalOf(key));
    constexpr const char* kList = "distortion_params";
    const nlohmann::json* const list = members.holder(kList).find(kList);
    const auto isZero = [](const nlohmann::json& k) { return k.is_number() && k == 0; };
    if (!list || (list->is_array() && std::ranges::all_of(*list, isZero))) return lens;
    lens.refusal = {"lens distortion is not rendered, and one of these coefficients is not 0",
                    members.where(kList), kUndistort};
    if (!list->is_array() || list->size() != 6) refuseLens(lens.refusal);
    const std::vector<double> numbers = *members.holder(kList).numbers(kList, 6);
    lens.k = {numbers[0], numbers[1], numbers[2], numbers[3]};
    lens.p1 = numbers[4];
    lens.p2 = numbers[5];
    return lens;
}

/// Returns the lens of a frame; nothing for a pinhole. The models are those of nerfstudio
/// (Cameras._generate_rays_from_coords) and instant-ngp (read_lens).
std::optional<Lens> lensIn(const FrameMembers& members, const CameraFileOptions& options) {
    const auto says = [&](const char* key) {
        const nlohmann::json* const value = members.holder(key).find(key);
        return value && *value != false;
    };
    const auto number = [&](const char* key) { return members.number(key).value_or(0); };
    const std::string model =
        members.holder("camera_model").text("camera_model").value_or("OPENCV");
    // instant-ngp's "equirectangular" is an equal-area cylinder.
    for (const char* key : {"equirectangular", "orthographic"})
        if (says(key)) refuseLens(noPinhole(members, key));
    if (says("ftheta_p0"))
        return checkedLens(options, "ftheta",
                           {number("ftheta_p0"), number("ftheta_p1"), number("ftheta_p2"),
                            number("ftheta_p3"), number("ftheta_p4")},
                           noPinhole(members, "ftheta_p0"));
    if (says("latlong"))
        return checkedLens(options, "equirectangular", {}, noPinhole(members, "latlong"));
    if (model == "EQUIRECTANGULAR") return checkedLens(options, model, {}, noPinholeModel(members));
    if (model == "FISHEYE624") {
        constexpr const char* kList = "distortion_params";
        const auto list = options.lenses ? members.holder(kList).numbers(kList, 12) : std::nullopt;
        return checkedLens(options, model, list.value_or(std::vector<double>(12)),
                           noPinholeModel(members));
    }
    const auto [k, p1, p2, refusal] = coefficientsIn(members);
    const bool is_fisheye = says("is_fisheye");
    if (is_fisheye || model == "OPENCV_FISHEYE") {
        const LensRefusal whole =
            is_fisheye ? noPinhole(members, "is_fisheye") : noPinholeModel(members);
        if (k[4] != 0 || k[5] != 0) refuseLens(refusal);
        if (p1 == 0 && p2 == 0)
            return checkedLens(options, "opencv-fisheye", {k[0], k[1], k[2], k[3]}, whole);
        return checkedLens(options, "thin-prism-fisheye", {k[0], k[1], p1, p2, k[2], k[3], 0, 0},
                           whole);
    }
    constexpr const char* kPinholes[] = {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL",
                                         "OPENCV",  "FULL_OPENCV",    "PERSPECTIVE"};
    if (std::ranges::find(kPinholes, model) == std::end(kPinholes))
        refuseLens(noPinholeModel(members));
    if (model == "FULL_OPENCV")
        return checkedLens(options, model, {k[0], k[1], p1, p2, k[2], k[3], k[4], k[5]}, refusal);
    if (options.lenses && k[3] != 0)
        refuseCamera("k4 is a factor of r^8 in nerfstudio, but a divisor in OpenCV", refusal.where,
                     "for OpenCV's, give the camera_model FULL_OPENCV");
    if (k[3] != 0 || k[4] != 0 || k[5] != 0) refuseLens(refusal);
    return checkedLens(options, "opencv", {k[0], k[1], p1, p2, k[2]}, refusal);
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

void readLens(const FrameMembers& members, const CameraObject& frame,
              const CameraFileOptions& options, FileCamera& camera) {
    camera.lens = lensIn(members, options);
    const auto width = members.number("w"), height = members.number("h");
    if (width.has_value() != height.has_value())
        refuseCamera("a picture needs both \"w\" and \"h\", or neither", frame.where());
    camera.size = width ? checkedSize(*width, *height, members.where("w")) : options.size;
    const int w = camera.size.width, h = camera.size.height;
    if (camera.lens && lensModel(*camera.lens).filling) return;
    auto fx = focalLength(members, "x", w);
    auto fy = focalLength(members, "y", h);
    if (camera.lens && lensModel(*camera.lens).in_pixels) fx = fy = 1;
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

/// Warns about intrinsics that differ from those that nerfstudio gives a picture of all directions:
/// the mapping of such a picture has no parameters.
void warnOfIntrinsics(const FrameMembers& members, const FileCamera& camera,
                      ReadWarnings& warnings) {
    if (!camera.lens || !lensModel(*camera.lens).filling) return;
    const double w = camera.size.width, h = camera.size.height;
    const std::pair<const char*, double> usual[] = {
        {"fl_x", w / 2}, {"fl_y", h}, {"cx", w / 2}, {"cy", h / 2}};
    for (const auto& [key, value] : usual)
        if (members.number(key).value_or(value) != value)
            warnings.warn(std::string(key) + " is ignored: the picture shows all directions.",
                          members.where(key));
}

std::vector<FileCamera> readTransforms(const CameraSource& source) {
    const CameraObject all(source.json(), source.path.string(), "");
    const nlohmann::json& frames = *all.find("frames");
    if (!frames.is_array())
        refuseCamera("expected a list of frames, not " + shownJson(frames), all.where("frames"));
    checkViewCount(frames.size(), all.where("frames"));
    checkMatrices(all);
    warnOfPassedOver(all, source.warnings);
    std::vector<FileCamera> cameras;
    cameras.reserve(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const CameraObject frame(frames[i], source.path.string(), childPointer("/frames", i));
        FileCamera& camera = cameras.emplace_back();
        camera.picture = frame.text("file_path").value_or("");
        camera.name = frame.text(kNameKey).value_or("");
        checkMatrices(frame);
        warnOfPassedOver(frame, source.warnings);
        const FrameMembers members(frame, all);
        readLens(members, frame, source.options, camera);
        warnOfIntrinsics(members, camera, source.warnings);
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

/// Returns the intrinsics; for a picture of all directions, those that nerfstudio gives it.
Intrinsics transformsIntrinsics(const FileCamera& camera) {
    checkWritten(camera);
    if (!camera.lens || !lensModel(*camera.lens).filling) return writtenIntrinsics(camera);
    const double w = camera.size.width, h = camera.size.height;
    return {w / 2, h, w / 2 - 0.5, h / 2 - 0.5};
}

/// A lens in the words of nerfstudio, and of instant-ngp for F-Theta. `coefficients` are numbers by
/// key; `list` is distortion_params.
struct TransformsLens {
    std::string model = "PINHOLE";
    std::vector<std::pair<std::string, double>> coefficients{};
    std::vector<double> list{};
};

/// A row for each lens that has a counterpart. `keys` are those of the coefficients, in order;
/// coefficients without a key must be 0.
struct TransformsLensRow {
    std::string_view lens;
    std::size_t most;  ///< number of coefficients of the lens, at most
    const char* model;
    std::vector<std::string_view> keys;
};
std::span<const TransformsLensRow> transformsLenses() {
    static const TransformsLensRow kRows[] = {
        {"simple-radial", 1, "OPENCV", {"k1"}},
        {"radial", 2, "OPENCV", {"k1", "k2"}},
        {"opencv", 5, "OPENCV", {"k1", "k2", "p1", "p2", "k3"}},
        {"opencv", 14, "FULL_OPENCV", {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
        {"full-opencv", 8, "FULL_OPENCV", {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
        {"opencv-fisheye", 4, "OPENCV_FISHEYE", {"k1", "k2", "k3", "k4"}},
        {"simple-fisheye", 0, "OPENCV_FISHEYE", {}},
        {"fisheye", 0, "OPENCV_FISHEYE", {}},
        {"simple-radial-fisheye", 1, "OPENCV_FISHEYE", {"k1"}},
        {"radial-fisheye", 2, "OPENCV_FISHEYE", {"k1", "k2"}},
        {"thin-prism-fisheye", 8, "OPENCV_FISHEYE", {"k1", "k2", "p1", "p2", "k3", "k4"}},
        {"ftheta", 10, "OPENCV", {"ftheta_p0", "ftheta_p1", "ftheta_p2", "ftheta_p3", "ftheta_p4"}},
        {"equirectangular", 0, "EQUIRECTANGULAR", {}},
    };
    return kRows;
}

/// Throws Error (kUsage) if neither program has the lens.
TransformsLens transformsLens(const FileCamera& camera) {
    if (!camera.lens) return {};
    const auto& [model, coefficients] = *camera.lens;
    if (model == "rad-tan-thin-prism-fisheye") return {"FISHEYE624", {}, coefficients};
    for (const TransformsLensRow& row : transformsLenses()) {
        if (row.lens != model || coefficients.size() > row.most) continue;
        TransformsLens lens{row.model};
        bool fits = true;
        for (std::size_t i = 0; i < coefficients.size(); ++i) {
            if (i < row.keys.size())
                lens.coefficients.emplace_back(row.keys[i], coefficients[i]);
            else
                fits = fits && coefficients[i] == 0;
        }
        if (fits) return lens;
    }
    refuseLensOutput(camera, "transforms.json has no lens like this " + model);
}

/// Returns the size and lens as the text of JSON members, each preceded by `before`.
std::string lensText(const FileCamera& camera, const char* before) {
    const Intrinsics k = transformsIntrinsics(camera);
    const auto [model, coefficients, list] = transformsLens(camera);
    std::vector<std::pair<std::string, double>> members = {
        {"w", camera.size.width}, {"h", camera.size.height}, {"fl_x", k.fx},
        {"fl_y", k.fy},           {"cx", k.cx + 0.5},        {"cy", k.cy + 0.5}};
    members.insert(members.end(), coefficients.begin(), coefficients.end());
    std::string text;
    for (const auto& [key, value] : members)
        text += before + ('"' + key + "\": ") + cameraNumber(value) + ",";
    if (!list.empty()) text += before + ("\"distortion_params\": [" + cameraNumbers(list)) + "],";
    return text;
}

std::string frameText(const FileCamera& camera, bool with_lens) {
    const std::string& picture = camera.picture.empty() ? camera.name : camera.picture;
    std::string text = "    {\"file_path\": " + jsonText(picture) + ",";
    if (viewName(picture) != camera.name)
        text += std::string(" \"") + kNameKey + "\": " + jsonText(camera.name) + ",";
    if (with_lens && camera.lens)
        text += " \"camera_model\": " + jsonText(transformsLens(camera).model) + ",";
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
        return camera.size == cameras.front().size && camera.lens == cameras.front().lens &&
               transformsIntrinsics(camera) == transformsIntrinsics(cameras.front());
    });
    const std::string model = shared ? transformsLens(cameras.front()).model : "PINHOLE";
    std::string text = "{\n  \"camera_model\": " + jsonText(model) + ",";
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
