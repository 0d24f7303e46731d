// SPDX-License-Identifier: Apache-2.0
// Options of camera and picture, and the View they make.
#include "cmd/options/camera_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "cmd/cli/arguments.h"
#include "cmd/cli/choices.h"
#include "core/base/error.h"
#include "core/scene/framing.h"
#include "core/scene/lights.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kLightPrefix = "light:";

const PlacedLight& chooseLight(const std::vector<PlacedLight>& lights, const std::string& camera) {
    std::vector<std::vector<std::string>> names;
    std::vector<std::string> listed;
    for (const PlacedLight& light : lights) {
        names.push_back({light.name, light.node_name});
        listed.push_back(std::string(kLightPrefix) + light.name);
    }
    if (const auto found = findNameOrIndex(camera.substr(kLightPrefix.size()), names))
        return lights[*found];
    if (lights.empty()) {
        throw Error(ErrorKind::kUsage,
                    "the scene has no lights of its own, and with an environment "
                    "none is built in",
                    "--camera " + camera, "leave --environment out");
    }
    throw Error(
        ErrorKind::kUsage, "unknown light", "--camera " + camera,
        choiceHint(camera, "lights", std::vector<std::string_view>(listed.begin(), listed.end())) +
            "; or an index from light:0 to light:" + std::to_string(lights.size() - 1));
}

/// The view that a light has (lightView in core/scene/lights.h), its projection as tight as it can
/// be, its size not set. NAME is the light's, its node's, or an index in draw order; "key" is the
/// built-in light of a scene without any. Throws Error (kUsage) for an unknown light, with the
/// list, and for a point light; (kInput) if there is nothing to fit a view to.
View lightCamera(const PosedScene& posed, const std::string& camera) {
    const std::vector<PlacedLight> lights = placedLights(posed);
    const PlacedLight& light = chooseLight(lights, camera);
    if (light.light.type == LightType::kPoint) {
        throw Error(ErrorKind::kUsage, "a point light shines all around, so it has no view",
                    "--camera " + camera, "choose a directional or a spot light");
    }
    const auto view = lightView(light, posed);
    if (!view) {
        throw Error(ErrorKind::kInput, "the scene has no vertices to fit the light's view to",
                    "--camera " + camera);
    }
    return *view;
}

constexpr double kDefaultFov = 40;  ///< degrees, vertical

double aspectOf(const View& view) {
    return static_cast<double>(view.width) / view.height;
}

void setSize(View& view, const Size& size, double aspect) {
    const Size whole = sizeWithAspect(size, aspect);
    view.width = whole.width;
    view.height = whole.height;
}

/// The view of one of the scene's cameras: its half height and aspect ratio, near and far, its
/// place.
View sceneCamera(const Scene& scene, const CameraInstance& instance, const std::string& name,
                 const Size& size) {
    const Camera& camera = scene.cameras[static_cast<std::size_t>(instance.camera)];
    const std::string where = "/cameras/" + std::to_string(instance.camera);
    View view;
    view.camera_name = name;
    Projection& projection = view.projection;
    projection.perspective = camera.perspective;
    projection.half_height = camera.perspective ? std::tan(camera.yfov / 2) : std::abs(camera.ymag);
    if (!(projection.half_height > 0 && std::isfinite(projection.half_height)) ||
        (camera.perspective && camera.yfov >= std::numbers::pi)) {
        throw Error(
            ErrorKind::kInput, "the camera has no usable extent", where,
            "yfov must lie between 0 and pi, ymag must not be 0; or choose another --camera");
    }
    double aspect = 16.0 / 9;
    if (camera.perspective && camera.aspect_ratio) {
        aspect = *camera.aspect_ratio;
    } else if (!camera.perspective) {
        aspect = std::abs(camera.xmag / camera.ymag);
    }
    if (!(aspect > 0 && std::isfinite(aspect))) {
        throw Error(ErrorKind::kInput, "the camera has no usable aspect ratio", where);
    }
    setSize(view, size, aspect);

    const auto place = rigid(instance.world);
    if (!place) {
        throw Error(ErrorKind::kInput, "the camera's node leaves no direction to look along",
                    "/nodes/" + std::to_string(instance.node),
                    "choose another --camera, or give --eye");
    }
    view.camera_to_world = *place;
    projection.near = camera.znear;
    projection.far = camera.zfar.value_or(std::numeric_limits<double>::infinity());
    return view;
}

/// The view of a light: at least what it lights, more where the size has another aspect ratio.
View viewOfLight(const CameraOptions& options, const PosedScene& posed) {
    View view = lightCamera(posed, *options.camera);
    Projection& projection = view.projection;
    setSize(view, options.size, projection.half_width / projection.half_height);
    projection.half_height =
        std::max(projection.half_height, projection.half_width / aspectOf(view));
    return view;
}

/// The view of a camera that is built from numbers, all of which may be missing: what is not given
/// is found by framing the scene.
View builtCamera(const CameraOptions& options, const SceneExtent& extent) {
    const Bounds bounds = extent.bounds();
    View view;
    setSize(view, options.size, 16.0 / 9);
    Projection& projection = view.projection;
    projection.perspective = !options.ortho_height;
    projection.half_height = options.ortho_height
                                 ? *options.ortho_height / 2
                                 : std::tan(glm::radians(options.fov.value_or(kDefaultFov)) / 2);
    projection.half_width = projection.half_height * aspectOf(view);

    glm::dvec3 target = options.target.value_or((bounds.min + bounds.max) * 0.5);
    glm::dvec3 up = glm::normalize(options.up.value_or(glm::dvec3(0, 1, 0)));
    glm::dvec3 eye;
    if (options.eye) {
        eye = *options.eye;
    } else {
        const Sight sight = framedSight(extent, up);
        const glm::dvec3& forward = sight.forward;
        up = sight.up;
        const double size = sceneSize(bounds);
        const auto reached = [&](const glm::dvec3& direction) {
            const double far = extent.reach(target, direction);
            return std::isfinite(far) ? far : 0.5 * size * glm::length(direction);  // empty
        };
        const bool centred = options.target.has_value();
        const glm::dvec3 offset = framingEye(reached, size, centred, forward, up, projection);
        eye = target + offset;
        if (!centred) target = eye - forward * glm::dot(offset, forward);
    }
    if (eye == target) {
        throw Error(ErrorKind::kUsage,
                    "the eye is at the target, so there is no direction to look along", "--eye",
                    options.target ? "move one of them"
                                   : "the target is the scene's centre; give --target");
    }
    auto place = lookAlong(eye, target - eye, up);
    // Straight down or up: north is up, as on a map, unless another up was asked for.
    if (!place && !options.up) place = lookAlong(eye, target - eye, {0, 0, -1});
    if (!place) {
        throw Error(ErrorKind::kUsage, "the up direction is parallel to the viewing direction",
                    "--up", "give an --up that points upwards in the picture");
    }
    view.camera_to_world = *place;

    const double scale = std::min(sceneSize(bounds), glm::length(target - eye));
    projection.near = projection.perspective ? 1e-4 * scale : 0;
    return view;
}

/// Sets near and far as asked for, and a far plane beyond the bounds where the projection needs
/// one. Throws Error (kUsage, or kInput for planes of the scene's own) if they make no range.
void setDepthRange(View& view, const CameraOptions& options, const Bounds& bounds) {
    Projection& projection = view.projection;
    if (options.near) projection.near = *options.near;
    if (options.far) projection.far = *options.far;
    if (!projection.perspective && !std::isfinite(projection.far)) {
        const double farthest = depthRange(bounds, view.camera_to_world).farthest;
        projection.far = std::max(farthest, projection.near) + 0.01 * sceneSize(bounds);
    }
    if (projection.near >= 0 && (projection.near > 0 || !projection.perspective) &&
        projection.far > projection.near) {
        return;
    }
    const bool asked = options.near || options.far;
    throw Error(asked ? ErrorKind::kUsage : ErrorKind::kInput,
                "the camera's near plane must lie before its far plane, and a perspective camera's "
                "in front "
                "of the eye",
                asked ? "--near, --far" : "camera " + view.camera_name, "give --near and --far");
}

Window tileOf(const Window& whole, const Shard& tile) {
    const auto [first, end] = tile.of(static_cast<std::size_t>(whole.height()));
    if (first == end) {
        throw Error(ErrorKind::kUsage,
                    "there are more tiles than the " + std::to_string(whole.height()) + " rows",
                    "--tile " + tile.text(), "divide the picture into fewer");
    }
    return {whole.x0, whole.y0 + static_cast<int>(first), whole.x1,
            whole.y0 + static_cast<int>(end)};
}

std::string cropText(const Window& crop) {
    return std::to_string(crop.x0) + ',' + std::to_string(crop.y0) + ',' +
           std::to_string(crop.width()) + ',' + std::to_string(crop.height());
}

}  // namespace

bool namesLight(const std::string& camera) {
    return camera.starts_with(kLightPrefix);
}

Size sizeWithAspect(Size size, double aspect) {
    if (size.height != 0) return size;
    const double height = std::round(size.width / aspect);
    if (!(height <= kMaxSide)) {
        throw Error(ErrorKind::kUsage, "the camera's aspect ratio makes the picture too high",
                    "--size " + std::to_string(size.width), "give the height too: --size WxH");
    }
    size.height = std::max(1, static_cast<int>(height));
    checkPixels(size);
    return size;
}

void checkCrop(const Window& crop, int width, int height) {
    if (crop.x1 <= width && crop.y1 <= height) return;
    throw Error(ErrorKind::kUsage, "the crop reaches outside the picture",
                "--crop " + cropText(crop),
                "the picture is " + std::to_string(width) + " x " + std::to_string(height) +
                    " pixels; --crop takes x,y,width,height");
}

void addCameraOptions(VerbOptions& verb, CameraOptions& options) {
    const auto text = [](const std::string& value) { return value; };
    const auto vector = [](const std::string& value) { return parseVector(value); };
    const auto add = [&](const char* name, const char* value, auto& target, auto parse,
                         const std::string& help) {
        addValue(verb, name, value, target, parse, help).group("Camera");
    };
    add("--camera", "NAME|INDEX", options.camera, text,
        "one of the scene's cameras; the index counts in draw order, as peeler info lists them "
        "(default: "
        "the first; the whole scene framed if there is none); light:NAME or light:INDEX is what a "
        "directional or spot light sees, light:key the built-in one of a scene without lights");
    add("--eye", "X,Y,Z", options.eye, vector,
        "where a camera of your own stands (default: where it sees the whole scene: what is flat "
        "from the front, all else from the right and above, with margins of 5 %)");
    add("--target", "X,Y,Z", options.target, vector,
        "the point it looks at (default: the scene's centre)");
    add(
        "--up", "X,Y,Z", options.up, [](const std::string& value) { return parseDirection(value); },
        "the direction that is up in the picture (default: 0,1,0)");
    add(
        "--fov", "DEGREES", options.fov, [](const std::string& value) { return parseFov(value); },
        "its vertical field of view (default: 40)");
    add(
        "--ortho-height", "H", options.ortho_height,
        [](const std::string& value) { return parsePositive(value); },
        "its height in scene units; makes it orthographic");
    add(
        "--near", "D", options.near, [](const std::string& value) { return parsePositive(value); },
        "nearest distance that is seen (default: the camera's own)");
    add(
        "--far", "D", options.far,
        [](const std::string& value) { return parsePositiveOrInfinite(value); },
        "farthest distance that is seen, or inf (default: the camera's own)");

    addValue(
        verb, "--size", "WxH|W", options.size,
        [](const std::string& value) { return parseSize(value); },
        "pixels; a width alone keeps the camera's aspect ratio (default: 1280x720)")
        .group("Picture");
    addValue(
        verb, "--crop", "X,Y,W,H", options.crop,
        [](const std::string& value) { return parseCrop(value); },
        "render this part of the picture only, in pixels from the upper left corner")
        .group("Picture");
    addValue(
        verb, "--tile", "I/N", options.tile,
        [](const std::string& value) { return parseShard(value); },
        "of the picture (or the crop) the I-th of N strips of rows, from 1/N at the top to N/N; "
        "peeler merge puts them together")
        .group("Picture");
}

void checkCameraOptions(const CameraOptions& options) {
    if (options.camera && options.buildsCamera()) {
        throw Error(ErrorKind::kUsage,
                    "--camera takes a camera of the scene, --eye, --target, --up, --fov "
                    "and --ortho-height build one",
                    "--camera " + *options.camera, "leave out the one or the others");
    }
    if (options.fov && options.ortho_height) {
        throw Error(ErrorKind::kUsage, "a camera has a field of view or an orthographic height",
                    "--fov, --ortho-height", "leave one of them out");
    }
    if (options.near && options.far && *options.near >= *options.far) {
        throw Error(ErrorKind::kUsage, "the near plane must lie before the far plane",
                    "--near, --far");
    }
    if (options.ortho_height && options.far && !std::isfinite(*options.far)) {
        throw Error(ErrorKind::kUsage, "an orthographic camera cannot see infinitely far",
                    "--far inf");
    }
    if (options.eye && options.target) {
        if (*options.eye == *options.target) {
            throw Error(ErrorKind::kUsage,
                        "the eye is at the target, so there is no direction to look along",
                        "--eye, --target", "move one of them");
        }
        if (options.up && !lookAlong(*options.eye, *options.target - *options.eye, *options.up)) {
            throw Error(ErrorKind::kUsage, "the up direction is parallel to the viewing direction",
                        "--up", "give an --up that points upwards in the picture");
        }
    }
    if (options.crop && options.size.height != 0) {
        checkCrop(*options.crop, options.size.width, options.size.height);
    }
}

std::vector<std::string> cameraNames(const PosedScene& posed) {
    const Scene& scene = posed.scene();
    std::vector<std::string> names;
    for (const CameraInstance& instance : posed.cameras()) {
        const std::string& own = scene.cameras[static_cast<std::size_t>(instance.camera)].name;
        const std::string& node = scene.nodes[static_cast<std::size_t>(instance.node)].name;
        if (!own.empty()) {
            names.push_back(own);
        } else {
            names.push_back(node.empty() ? "camera " + std::to_string(names.size()) : node);
        }
    }
    return names;
}

View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraOptions& options) {
    const Bounds box = extent.bounds();
    View view;
    if (options.camera && namesLight(*options.camera)) {
        view = viewOfLight(options, posed);
    } else if (!options.buildsCamera() && !posed.cameras().empty()) {
        const std::vector<std::string> names = cameraNames(posed);
        std::size_t chosen = 0;
        if (options.camera) {
            std::vector<std::vector<std::string>> alternatives;
            for (std::size_t i = 0; i < names.size(); ++i) {
                const auto node = static_cast<std::size_t>(posed.cameras()[i].node);
                alternatives.push_back({names[i], posed.scene().nodes[node].name});
            }
            chosen = chooseFrom("camera", *options.camera, alternatives);
        }
        view = sceneCamera(posed.scene(), posed.cameras()[chosen], names[chosen], options.size);
    } else {
        if (options.camera) chooseFrom("camera", *options.camera, {});
        view = builtCamera(options, extent);
    }
    view.projection.half_width = view.projection.half_height * aspectOf(view);
    setDepthRange(view, options, box);
    view.crop = {0, 0, view.width, view.height};
    if (options.crop) {
        checkCrop(*options.crop, view.width, view.height);
        view.crop = *options.crop;
    }
    if (options.tile) view.crop = tileOf(view.crop, *options.tile);
    return view;
}

}  // namespace peeler::cmd
