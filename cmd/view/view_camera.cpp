// SPDX-License-Identifier: Apache-2.0
#include "cmd/view/view_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "cmd/cli/errors.h"
#include "cmd/cli/options.h"
#include "cmd/options/camera_options.h"
#include "core/base/error.h"
#include "core/image/median_depth.h"
#include "core/scene/placement.h"

namespace peeler::cmd {

namespace {

glm::dvec2 parseAngles(std::string_view text) {
    const auto numbers = parseNumbers<2>(text, "yaw,pitch");
    return {numbers[0], numbers[1]};
}

/// Turns a camera about a point: to the right about `up`, then upwards about its own right.
glm::dmat4 orbited(const glm::dmat4& camera, const glm::dvec3& center, const glm::dvec3& up,
                   const glm::dvec2& degrees) {
    const auto about = [&](double angle, const glm::dvec3& axis) {
        return glm::translate(glm::dmat4(1), center) *
               glm::rotate(glm::dmat4(1), glm::radians(angle), axis) *
               glm::translate(glm::dmat4(1), -center);
    };
    const glm::dmat4 yawed = about(degrees.x, up) * camera;
    return about(-degrees.y, glm::dvec3(yawed[0])) * yawed;
}

/// A distance from `view`'s camera that nothing in the file exceeds.
double farthest(const LayeredImage& image, const View& own, const View& view) {
    const double depth = image.z.empty() ? 1 : *std::max_element(image.z.begin(), image.z.end());
    const double scale = own.projection.perspective ? depth : 1;
    const glm::dvec3 corner(own.projection.half_width * scale, own.projection.half_height * scale,
                            depth);
    return glm::length(corner) +
           glm::length(glm::dvec3(view.camera_to_world[3] - own.camera_to_world[3]));
}

}  // namespace

void addViewCameraOptions(VerbOptions& verb, ViewCameraOptions& options) {
    const auto add = [&](const char* name, const char* value, auto& target, auto parse,
                         const std::string& help, const char* group) {
        addValue(
            verb, name, value, target, [parse](const std::string& text) { return parse(text); },
            help)
            .group(group);
    };
    add("--orbit", "YAW,PITCH", options.orbit, parseAngles,
        "degrees by which the file's camera goes round the target, to the right and upwards",
        "Camera");
    add("--eye", "X,Y,Z", options.eye, parseVector,
        "where a camera of your own stands (default: where the file's does)", "Camera");
    add("--target", "X,Y,Z", options.target, parseVector,
        "the point it looks at (default: on the file's viewing axis, as deep as the middle of the "
        "picture)",
        "Camera");
    add("--up", "X,Y,Z", options.up, parseDirection,
        "the direction that is up in the picture, and the axis of --orbit (default: 0,1,0)",
        "Camera");
    add("--fov", "DEGREES", options.fov, parseFov,
        "vertical field of view (default: that of the file's camera)", "Camera");
    add("--ortho-height", "H", options.ortho_height, parsePositive,
        "height in scene units; makes it orthographic", "Camera");
    add("--size", "WxH|W", options.size, parseSize,
        "pixels; a width alone keeps the file's aspect ratio (default: that of the file)",
        "Picture");
    add("--crop", "X,Y,W,H", options.crop, parseCrop,
        "render this part of the picture only, in pixels from the upper left corner", "Picture");
}

void checkViewCameraOptions(const ViewCameraOptions& options) {
    if (options.fov && options.ortho_height)
        refuse("a camera has a field of view or an orthographic height", "--fov, --ortho-height",
               "leave one of them out");
    if (options.orbit && options.eye)
        refuse("--orbit moves the file's camera, --eye builds another one", "--orbit, --eye",
               "leave one of them out");
    if (options.eye && options.target && *options.eye == *options.target)
        refuse("the eye is at the target, so there is no direction to look along",
               "--eye, --target", "move one of them");
}

glm::dvec3 centerOfInterest(const LayeredImage& image, const View& view) {
    const glm::dmat4& place = view.camera_to_world;
    return glm::dvec3(place[3]) - glm::dvec3(place[2]) * medianDepth(image, view).value_or(1);
}

View viewFrom(const View& own, const LayeredImage& image, const ViewCameraOptions& options) {
    View view = own;
    Projection& projection = view.projection;
    if (options.size) {
        const double aspect = static_cast<double>(own.width) / own.height;
        const Size size = sizeWithAspect(*options.size, aspect);
        view.width = size.width;
        view.height = size.height;
    }
    checkPixels({view.width, view.height});
    if (options.fov) {
        projection.perspective = true;
        projection.half_height = std::tan(glm::radians(*options.fov) / 2);
    } else if (options.ortho_height) {
        projection.perspective = false;
        projection.half_height = *options.ortho_height / 2;
    }
    if (options.fov || options.ortho_height || options.size)
        projection.half_width = projection.half_height * view.width / view.height;

    const glm::dvec3 eye = options.eye.value_or(glm::dvec3(own.camera_to_world[3]));
    const glm::dvec3 target = options.target.value_or(centerOfInterest(image, own));
    const glm::dvec3 up = glm::normalize(options.up.value_or(glm::dvec3(0, 1, 0)));
    if (options.orbit) {
        view.camera_to_world = orbited(own.camera_to_world, target, up, *options.orbit);
    } else if (options.eye || options.target || options.up) {
        if (eye == target)
            refuse("the eye is at the target, so there is no direction to look along", "--eye",
                   "give --target");
        auto place = lookAlong(eye, target - eye, up);
        if (!place && !options.up)
            place = lookAlong(eye, target - eye, glm::dvec3(own.camera_to_world[1]));
        if (!place)
            refuse("the up direction is parallel to the viewing direction", "--up",
                   "give an --up that points upwards in the picture");
        view.camera_to_world = *place;
    }
    const bool moved = view.camera_to_world != own.camera_to_world ||
                       projection.perspective != own.projection.perspective;
    if (moved) {
        view.camera_name.clear();
        // The file's planes have clipped what it holds; here they would clip once more.
        const double distance = glm::length(target - glm::dvec3(view.camera_to_world[3]));
        projection.near = projection.perspective ? 1e-4 * distance : 0;
        projection.far = projection.perspective ? std::numeric_limits<double>::infinity()
                                                : farthest(image, own, view);
    }
    view.crop = {0, 0, view.width, view.height};
    if (options.crop) {
        checkCrop(*options.crop, view.width, view.height);
        view.crop = *options.crop;
    } else if (!moved && !options.size) {
        view.crop = own.crop;
    }
    return view;
}

}  // namespace peeler::cmd
