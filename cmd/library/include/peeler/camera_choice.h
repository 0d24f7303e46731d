// SPDX-License-Identifier: Apache-2.0
// Camera selection: a scene camera, a light, or a camera given by numbers.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>

#include <peeler/lens.h>
#include <peeler/view.h>
#include <peeler/window.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The size of a picture in pixels.
struct Size {
    int width = 0;
    int height = 0;  ///< 0: computed from the width and the camera's aspect ratio
    bool operator==(const Size&) const = default;
};

/// The intrinsics of a calibrated pinhole camera, in pixels. The point (x, y, z) in camera space (x
/// right, y down, z forward) projects to (fx · x / z + cx, fy · y / z + cy), where (0, 0) is the
/// centre of the upper left pixel (OpenCV's convention). Programs that put (0, 0) at that pixel's
/// upper left corner have cx and cy larger by 0.5.
struct Intrinsics {
    double fx = 1, fy = 1, cx = 0, cy = 0;
    bool operator==(const Intrinsics&) const = default;
};

/// Returns the intrinsics of a view's crop: the values with the fewest digits from which
/// CameraChoice::intrinsics reproduces the view exactly. If there are no such values (for example,
/// for a view made from a field of view), returns the nearest values. Throws Error (kUsage) if the
/// view is orthographic.
Intrinsics intrinsicsOf(const View& view);

/// A scene camera, or a camera given by numbers. The default is the scene's first camera or, if the
/// scene has no camera, a camera that frames the whole scene. Numbers that are not given are chosen
/// so that the camera frames the whole scene.
struct CameraChoice {
    /// The camera's name, or its index in draw order. "light:NAME" or "light:INDEX" selects a
    /// light. "auto" frames the whole scene, even if the scene has a camera.
    std::optional<std::string> camera{};
    /// World space; `up` is not 0.
    std::optional<glm::dvec3> eye{}, target{}, up{};
    /// Camera to world, looking along −Z with +Y up (glTF's convention). Replaces `eye`, `target`
    /// and `up`.
    std::optional<glm::dmat4> pose{};
    std::optional<double> fov{};           ///< vertical field of view, degrees
    std::optional<double> ortho_height{};  ///< height of an orthographic picture, scene units
    /// Replaces the field of view of any camera; `size` must have a height. The picture becomes a
    /// crop of a larger picture that is centred on the axis and has the size View::width x
    /// View::height. View::sample holds the fractional part of the crop's offset.
    std::optional<Intrinsics> intrinsics{};
    /// A lens other than a pinhole, with these intrinsics. `near` and `far` are then distances
    /// along the rays, by default 0 and infinity.
    std::optional<Lens> lens{};
    std::optional<double> near{}, far{};  ///< distances to the near and far plane, scene units
    Size size{1280, 720};
    std::optional<Window> crop{};  ///< the part of the picture to render, pixels

    /// Whether the camera is built from numbers rather than taken from the scene.
    bool buildsCamera() const { return eye || target || up || pose || fov || ortho_height; }
};

/// Throws Error (kUsage) if the fields contradict each other. Does not need the scene.
void checkCamera(const CameraChoice& choice);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
