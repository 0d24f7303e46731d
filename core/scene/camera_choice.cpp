// SPDX-License-Identifier: Apache-2.0
#include "core/scene/camera_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include <peeler/error.h>
#include "core/base/names.h"
#include "core/scene/framing.h"
#include "core/scene/intrinsics.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler::inline v0 {
namespace {

constexpr std::string_view kLightPrefix = "light:";

/// Whether to frame the scene even if the scene has cameras.
bool framesScene(const CameraChoice& choice) {
    return choice.camera == "auto";
}

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
                    "the scene has no lights, and an environment turns off the built-in light",
                    Parameter::kCamera + " " + camera, "leave " + Parameter::kEnvironment + " out");
    }
    throw Error(
        ErrorKind::kUsage, "unknown light", Parameter::kCamera + " " + camera,
        choiceHint(camera, "lights", std::vector<std::string_view>(listed.begin(), listed.end())) +
            "; or an index from light:0 to light:" + std::to_string(lights.size() - 1));
}

/// Returns the view of a light (lightView() in core/scene/lights.h), with the tightest projection,
/// but without width and height. `camera` is "light:" followed by the light's name, its node's
/// name, or its index in draw order. The name "key" selects the built-in light of a scene without
/// lights. Throws Error (kUsage) if the light is unknown, with the list of lights, or if it is a
/// point light; (kInput) if there are no vertices to fit the view to.
View lightCamera(const PosedScene& posed, const std::string& camera) {
    const std::vector<PlacedLight> lights = placedLights(posed);
    const PlacedLight& light = chooseLight(lights, camera);
    if (light.light.type == LightType::kPoint) {
        throw Error(ErrorKind::kUsage, "a point light shines in all directions, so it has no view",
                    Parameter::kCamera + " " + camera, "choose a directional or a spot light");
    }
    const auto view = lightView(light, posed);
    if (!view) {
        throw Error(ErrorKind::kInput, "the scene has no vertices to fit the light's view to",
                    Parameter::kCamera + " " + camera,
                    "choose another " + Parameter::kCamera + ", or give " + Parameter::kEye);
    }
    return *view;
}

double aspectOf(const View& view) {
    return static_cast<double>(view.width) / view.height;
}

void setSize(View& view, const Size& size, double aspect) {
    const Size whole = sizeWithAspect(size, aspect);
    view.width = whole.width;
    view.height = whole.height;
}

/// Returns the view of a scene camera, with its half height, aspect ratio, near and far planes, and
/// placement.
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
        throw Error(ErrorKind::kInput, "the camera has no usable extent", where,
                    "yfov must lie between 0 and pi, ymag must not be 0; or choose another " +
                        Parameter::kCamera);
    }
    double aspect = 16.0 / 9;
    if (camera.perspective && camera.aspect_ratio) {
        aspect = *camera.aspect_ratio;
    } else if (!camera.perspective) {
        aspect = std::abs(camera.xmag / camera.ymag);
    }
    if (!(aspect > 0 && std::isfinite(aspect))) {
        throw Error(ErrorKind::kInput, "the camera has no usable aspect ratio", where,
                    "xmag must not be 0; or choose another " + Parameter::kCamera);
    }
    setSize(view, size, aspect);

    const auto place = rigid(instance.world);
    if (!place) {
        throw Error(ErrorKind::kInput, "the camera's node gives no viewing direction",
                    "/nodes/" + std::to_string(instance.node),
                    "choose another " + Parameter::kCamera + ", or give " + Parameter::kEye);
    }
    view.camera_to_world = *place;
    projection.near = camera.znear;
    projection.far = camera.zfar.value_or(std::numeric_limits<double>::infinity());
    return view;
}

/// Returns the view of a light. At any aspect ratio, the view covers at least the lit area.
View viewOfLight(const CameraChoice& choice, const PosedScene& posed) {
    View view = lightCamera(posed, *choice.camera);
    Projection& projection = view.projection;
    setSize(view, choice.size, projection.half_width / projection.half_height);
    projection.half_height =
        std::max(projection.half_height, projection.half_width / aspectOf(view));
    return view;
}

/// Returns a near distance that clips nothing visible to a camera at `distance` from the scene.
double safeNear(const Bounds& bounds, double distance) {
    return 1e-4 * (distance > 0 ? std::min(sceneSize(bounds), distance) : sceneSize(bounds));
}

/// Returns the view of a camera with a given pose.
View placedCamera(const CameraChoice& choice, const Bounds& bounds) {
    View view;
    setSize(view, choice.size, 16.0 / 9);
    // A rigid pose is used unchanged, so that the pose of an earlier view reproduces exactly this
    // view.
    const auto place =
        distanceFromRigid(*choice.pose) < kRigidByRounding ? choice.pose : rigid(*choice.pose);
    if (!place) {
        throw Error(ErrorKind::kUsage, "the pose gives no viewing direction", Parameter::kPose,
                    "give a rotation and a translation");
    }
    view.camera_to_world = *place;
    Projection& projection = view.projection;
    projection.perspective = !choice.ortho_height;
    projection.half_height = choice.ortho_height
                                 ? *choice.ortho_height / 2
                                 : std::tan(glm::radians(choice.fov.value_or(kDefaultFov)) / 2);
    const glm::dvec3 centre = (bounds.min + bounds.max) * 0.5;
    const double distance = glm::length(centre - glm::dvec3(view.camera_to_world[3]));
    projection.near = projection.perspective ? safeNear(bounds, distance) : 0;
    return view;
}

/// Returns the view of a camera built from optional parameters. Missing parameters are found by
/// framing the scene.
View builtCamera(const CameraChoice& choice, const SceneExtent& extent) {
    const Bounds bounds = extent.bounds();
    View view;
    setSize(view, choice.size, 16.0 / 9);
    Projection& projection = view.projection;
    projection.perspective = !choice.ortho_height;
    projection.half_height = choice.ortho_height
                                 ? *choice.ortho_height / 2
                                 : std::tan(glm::radians(choice.fov.value_or(kDefaultFov)) / 2);
    projection.half_width = projection.half_height * aspectOf(view);
    if (choice.intrinsics) {  // framing assumes that the axis goes through the centre
        projection.half_width = view.width / (2 * choice.intrinsics->fx);
        projection.half_height = view.height / (2 * choice.intrinsics->fy);
    }

    glm::dvec3 target = choice.target.value_or((bounds.min + bounds.max) * 0.5);
    glm::dvec3 up = glm::normalize(choice.up.value_or(glm::dvec3(0, 1, 0)));
    glm::dvec3 eye;
    if (choice.eye) {
        eye = *choice.eye;
    } else {
        const FramingDirection framing = framingDirection(extent, up);
        const glm::dvec3& forward = framing.forward;
        up = framing.up;
        const double size = sceneSize(bounds);
        const auto reached = [&](const glm::dvec3& direction) {
            const double far = extent.reach(target, direction);
            // `far` is not finite if the scene is empty.
            return std::isfinite(far) ? far : 0.5 * size * glm::length(direction);
        };
        const bool centred = choice.target.has_value();
        const glm::dvec3 offset = framingEye(reached, size, centred, forward, up, projection);
        eye = target + offset;
        if (!centred) target = eye - forward * glm::dot(offset, forward);
    }
    if (eye == target) {
        throw Error(ErrorKind::kUsage, "the eye is at the target, so there is no viewing direction",
                    Parameter::kEye,
                    choice.target ? "move one of them"
                                  : "the target is the scene's centre; give " + Parameter::kTarget);
    }
    auto place = lookAlong(eye, target - eye, up);
    // If the camera looks straight down or up and `up` is not given, -Z is up in the picture, like
    // north on a map.
    if (!place && !choice.up) place = lookAlong(eye, target - eye, {0, 0, -1});
    if (!place) {
        throw Error(ErrorKind::kUsage, "the up direction is parallel to the viewing direction",
                    Parameter::kUp,
                    "give an " + Parameter::kUp + " that points upwards in the picture");
    }
    view.camera_to_world = *place;

    const double distance = glm::length(target - eye);
    projection.near = projection.perspective ? safeNear(bounds, distance) : 0;
    return view;
}

/// Sets near and far as requested. An orthographic view without a far plane gets a far plane beyond
/// the bounds. Throws Error (kUsage, or kInput for the scene's own planes) if near and far do not
/// form a range.
void setDepthRange(View& view, const CameraChoice& choice, const Bounds& bounds) {
    Projection& projection = view.projection;
    if (choice.near) projection.near = *choice.near;
    if (choice.far) projection.far = *choice.far;
    if (!projection.perspective && !std::isfinite(projection.far)) {
        const double farthest = depthRange(bounds, view.camera_to_world).farthest;
        projection.far = std::max(farthest, projection.near) + 0.01 * sceneSize(bounds);
    }
    if (projection.near >= 0 && (projection.near > 0 || !projection.perspective || view.rays) &&
        projection.far > projection.near) {
        return;
    }
    const bool asked = choice.near || choice.far;
    throw Error(asked ? ErrorKind::kUsage : ErrorKind::kInput,
                "the camera's near plane must lie before its far plane and, in a perspective "
                "camera, in front of the eye",
                asked ? Parameter::kNear + ", " + Parameter::kFar : "camera " + view.camera_name,
                "give " + Parameter::kNear + " and " + Parameter::kFar);
}

std::string cropText(const Window& crop) {
    return std::to_string(crop.x0) + ',' + std::to_string(crop.y0) + ',' +
           std::to_string(crop.width()) + ',' + std::to_string(crop.height());
}

}  // namespace

void checkCamera(const CameraChoice& choice) {
    if (choice.camera && !framesScene(choice) && choice.buildsCamera()) {
        throw Error(ErrorKind::kUsage,
                    Parameter::kCamera + " selects a camera of the scene, but " + Parameter::kEye +
                        ", " + Parameter::kTarget + ", " + Parameter::kUp + ", " +
                        Parameter::kPose + ", " + Parameter::kFov + " and " +
                        Parameter::kOrthoHeight + " build one",
                    Parameter::kCamera + " " + *choice.camera,
                    "leave out " + Parameter::kCamera + " or the others");
    }
    if (choice.fov && *choice.fov >= 180 && !choice.lens) {
        throw Error(ErrorKind::kUsage, "a camera without a lens sees less than 180 degrees",
                    Parameter::kFov, "give a smaller angle");
    }
    if (choice.fov && choice.ortho_height) {
        throw Error(ErrorKind::kUsage,
                    "a camera has either a field of view or an orthographic height",
                    Parameter::kFov + ", " + Parameter::kOrthoHeight, "leave one of them out");
    }
    if (choice.pose && (choice.eye || choice.target || choice.up)) {
        throw Error(ErrorKind::kUsage, "a camera has either a pose or an eye, target and up",
                    Parameter::kPose + ", " + Parameter::kEye + ", " + Parameter::kTarget + ", " +
                        Parameter::kUp,
                    "leave out " + Parameter::kPose + " or the others");
    }
    if (choice.intrinsics && (choice.fov || choice.ortho_height)) {
        throw Error(
            ErrorKind::kUsage, "intrinsics already define the field of view",
            Parameter::kIntrinsics + ", " + Parameter::kFov + ", " + Parameter::kOrthoHeight,
            "leave out " + Parameter::kIntrinsics + " or the others");
    }
    if (choice.intrinsics && choice.size.height == 0) {
        throw Error(ErrorKind::kUsage, "intrinsics need a picture size",
                    Parameter::kIntrinsics + ", " + Parameter::kSize + " " +
                        std::to_string(choice.size.width),
                    "give the height too: " + Parameter::kSize + " WxH");
    }
    if (choice.near && choice.far && *choice.near >= *choice.far) {
        throw Error(ErrorKind::kUsage, "the near plane must lie before the far plane",
                    Parameter::kNear + ", " + Parameter::kFar);
    }
    if (choice.ortho_height && choice.far && !std::isfinite(*choice.far)) {
        throw Error(ErrorKind::kUsage, "an orthographic camera cannot see infinitely far",
                    Parameter::kFar + " inf");
    }
    if (choice.eye && choice.target) {
        if (*choice.eye == *choice.target) {
            throw Error(ErrorKind::kUsage,
                        "the eye is at the target, so there is no viewing direction",
                        Parameter::kEye + ", " + Parameter::kTarget, "move one of them");
        }
        if (choice.up && !lookAlong(*choice.eye, *choice.target - *choice.eye, *choice.up)) {
            throw Error(ErrorKind::kUsage, "the up direction is parallel to the viewing direction",
                        Parameter::kUp,
                        "give an " + Parameter::kUp + " that points upwards in the picture");
        }
    }
    if (choice.crop && choice.size.height != 0) {
        checkCrop(*choice.crop, choice.size.width, choice.size.height);
    }
}

}  // namespace peeler::inline v0

namespace peeler {

void checkPixels(const Size& size) {
    if (size.width > kMostPictureSide || size.height > kMostPictureSide)
        throw Error(ErrorKind::kUsage, "the picture is more than " +
                                           std::to_string(kMostPictureSide) +
                                           " pixels wide or high");
    if (static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height) >
        kMostPixels)
        throw Error(ErrorKind::kUsage,
                    "the picture has more than " + std::to_string(kMostPixels) + " pixels");
}

bool namesLight(const std::string& camera) {
    return camera.starts_with(kLightPrefix);
}

Size sizeWithAspect(Size size, double aspect) {
    if (size.height != 0) return size;
    const double height = std::round(size.width / aspect);
    if (!(height <= kMostPictureSide)) {
        throw Error(ErrorKind::kUsage, "the camera's aspect ratio makes the picture too high",
                    Parameter::kSize + " " + std::to_string(size.width),
                    "give the height too: " + Parameter::kSize + " WxH");
    }
    size.height = std::max(1, static_cast<int>(height));
    checkPixels(size);
    return size;
}

void checkCrop(const Window& crop, int width, int height) {
    if (crop.x1 <= width && crop.y1 <= height) return;
    throw Error(ErrorKind::kUsage, "the crop reaches outside the picture",
                Parameter::kCrop + " " + cropText(crop),
                "the picture is " + std::to_string(width) + " x " + std::to_string(height) +
                    " pixels; " + Parameter::kCrop + " takes x,y,width,height");
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

View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraChoice& choice) {
    const Bounds box = extent.bounds();
    View view;
    if (choice.camera && namesLight(*choice.camera)) {
        view = viewOfLight(choice, posed);
    } else if (!choice.buildsCamera() && !framesScene(choice) && !posed.cameras().empty()) {
        const std::vector<std::string> names = cameraNames(posed);
        std::size_t chosen = 0;
        if (choice.camera) {
            std::vector<std::vector<std::string>> alternatives;
            for (std::size_t i = 0; i < names.size(); ++i) {
                const auto node = static_cast<std::size_t>(posed.cameras()[i].node);
                alternatives.push_back({names[i], posed.scene().nodes[node].name});
            }
            chosen = chooseFrom("camera", Parameter::kCamera, *choice.camera, alternatives);
        }
        view = sceneCamera(posed.scene(), posed.cameras()[chosen], names[chosen], choice.size);
    } else if (choice.pose) {
        view = placedCamera(choice, box);
    } else {
        if (choice.camera && !framesScene(choice))
            chooseFrom("camera", Parameter::kCamera, *choice.camera, {});
        view = builtCamera(choice, extent);
    }
    view.projection.half_width = view.projection.half_height * aspectOf(view);
    view.crop = {0, 0, view.width, view.height};
    if (choice.crop) checkCrop(*choice.crop, view.width, view.height);
    if (choice.lens)
        setLens(view, {*choice.lens, choice.intrinsics.value_or(Intrinsics())});
    else if (choice.intrinsics)
        setIntrinsics(view, *choice.intrinsics);
    setDepthRange(view, choice, box);
    if (const auto& crop = choice.crop) {
        const int x = view.crop.x0, y = view.crop.y0;
        view.crop = {x + crop->x0, y + crop->y0, x + crop->x1, y + crop->y1};
    }
    return view;
}

}  // namespace peeler
