// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/camera_options.h"

#include <peeler/error.h>
#include <algorithm>
#include <array>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "cmd/cli/arguments.h"
#include "cmd/options/scene_options.h"
#include "core/scene/framing.h"
#include "core/scene/view.h"
#include "formats/cameras/camera_formats.h"

namespace peeler::cmd {

namespace {

Window tileOf(const Window& whole, const Shard& tile) {
    const auto [first, end] = tile.of(static_cast<std::size_t>(whole.height()));
    if (first == end) {
        throw Error(ErrorKind::kUsage,
                    "there are more tiles than the " + std::to_string(whole.height()) + " rows",
                    "--tile " + tile.text(), "divide the picture into fewer tiles");
    }
    return {whole.x0, whole.y0 + static_cast<int>(first), whole.x1,
            whole.y0 + static_cast<int>(end)};
}

Intrinsics parseIntrinsics(const std::string& text) {
    const auto [fx, fy, cx, cy] = parseNumbers<4>(text, "fx,fy,cx,cy");
    if (!(fx > 0 && fy > 0))
        throw Error(ErrorKind::kUsage, "expected focal lengths greater than 0");
    return {fx, fy, cx, cy};
}

/// Converts a world-to-camera matrix in OpenCV's convention (12 or 16 numbers, row by row) to a
/// camera-to-world matrix in glTF's. Throws Error (kUsage) if the matrix scales, mirrors or shears.
glm::dmat4 parsePose(const std::string& text) {
    constexpr const char* kExpected = "r00,r01,r02,t0,r10,…, the rows of a 3 x 4 or 4 x 4 matrix";
    std::array<double, 16> rows{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    if (std::ranges::count(text, ',') == 15)
        rows = parseNumbers<16>(text, kExpected);
    else
        std::ranges::copy(parseNumbers<12>(text, kExpected), rows.begin());
    const glm::dmat4 world_to_camera = glm::transpose(glm::make_mat4(rows.data()));
    if (glm::row(world_to_camera, 3) != glm::dvec4(0, 0, 0, 1))
        throw Error(ErrorKind::kUsage, "expected a last row of 0,0,0,1");
    constexpr double kMostOff = 1e-4;
    if (!(distanceFromRigid(world_to_camera) < kMostOff))
        throw Error(
            ErrorKind::kUsage, "expected a rotation and a translation", "",
            "scale the scene instead of the pose; use OpenCV's axes: x right, y down, z forward");
    return poseOfOpencv(world_to_camera, "--pose");
}

}  // namespace

void addCameraOptions(VerbOptions& verb, CameraOptions& options, SceneReadOptions* reading,
                      bool lenses) {
    const auto text = [](const std::string& value) { return value; };
    const auto vector = [](const std::string& value) { return parseVector(value); };
    const auto add = [&](const char* name, const char* value, auto& target, auto parse,
                         const std::string& help) {
        addValue(verb, name, value, target, parse, help).group("Camera");
    };
    add("--camera", "NAME|INDEX|auto", options.camera, text,
        "camera of the scene, by name or by index as peeler info lists it; auto shows the whole "
        "scene even if it has cameras; light:NAME or light:INDEX looks from a directional or spot "
        "light, light:key from the built-in light of a scene without lights (default: the first "
        "camera, or a view of the whole scene if it has "
        "no camera)");
    add("--eye", "X,Y,Z", options.eye, vector,
        "position of a custom camera (default: one that sees the whole scene with margins of 5 %, "
        "from the front, slightly from the right and above, or along a flat scene's thin axis)");
    add("--target", "X,Y,Z", options.target, vector,
        "point the camera looks at (default: the scene's centre)");
    verb.addRepeated(
            "--up", reading ? "X,Y,Z|x|y|z" : "X,Y,Z",
            [&options, reading](const std::string& value) {
                const std::optional<Axis> axis = reading ? axisNamed(value) : std::nullopt;
                if (axis)
                    reading->up = axis;
                else
                    options.up = parseDirection(value);
            },
            reading
                ? std::string("X,Y,Z: up direction in the picture (default: 0,1,0); x, y or z: ") +
                      kUpHelp
                : "up direction in the picture (default: 0,1,0)")
        .group("Camera");
    add(
        "--fov", "DEGREES", options.fov,
        [lenses](const std::string& value) {
            return lenses ? parseLensFov(value) : parseFov(value);
        },
        lenses ? "vertical field of view; with --lens, up to 360 (default: 40)"
               : "vertical field of view (default: 40)");
    add(
        "--ortho-height", "H", options.ortho_height,
        [](const std::string& value) { return parsePositive(value); },
        "height of the view in scene units; makes the camera orthographic");
    add("--intrinsics", "FX,FY,CX,CY", options.intrinsics, parseIntrinsics,
        "focal lengths and principal point in pixels, as in OpenCV, instead of --fov: the point "
        "x,y,z in camera space (x right, y down) appears at fx*x/z+cx, fy*y/z+cy; 0,0 is the "
        "centre of the upper left pixel; needs --size WxH");
    add("--pose", "MATRIX", options.pose, parsePose,
        "pose of a custom camera, instead of --eye, --target and --up: the world-to-camera matrix "
        "as in OpenCV (z forward), 3 x 4 or 4 x 4 numbers, row by row");
    add(
        "--near", "D", options.near, [](const std::string& value) { return parsePositive(value); },
        "distance of the near plane (default: the camera's own)");
    add(
        "--far", "D", options.far,
        [](const std::string& value) { return parsePositiveOrInfinite(value); },
        "distance of the far plane, or inf (default: the camera's own)");

    addValue(
        verb, "--size", "WxH|W", options.size,
        [&options](const std::string& value) {
            options.size_given = true;
            return parseSize(value);
        },
        "size in pixels; a width alone keeps the camera's aspect ratio (default: 1280x720)")
        .group("Picture");
    addValue(
        verb, "--crop", "X,Y,W,H", options.crop,
        [](const std::string& value) { return parseCrop(value); },
        "render only this part of the picture, in pixels from the upper left corner")
        .group("Picture");
    addValue(
        verb, "--tile", "I/N", options.tile,
        [](const std::string& value) { return parseShard(value); },
        "render only the I-th of N strips of rows of the picture (or the crop), from 1/N at the "
        "top to N/N; peeler merge joins them")
        .group("Picture");
}

View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraOptions& options) {
    const CameraChoice& choice = options;
    View view = makeView(posed, extent, choice);
    if (options.tile) view.crop = tileOf(view.crop, *options.tile);
    return view;
}

}  // namespace peeler::cmd
