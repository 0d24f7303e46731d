// SPDX-License-Identifier: Apache-2.0
// Camera selection: a scene camera, a light, or a camera given by numbers.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>

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

/// Returns the intrinsics of a view's crop. If CameraChoice::intrinsics can reproduce the view
/// exactly, returns the values with the fewest digits that do. Otherwise, for example for a view
/// made from a field of view, returns the nearest values. Throws Error (kUsage) if the view is
/// orthographic.
Intrinsics intrinsicsOf(const View& view);

/// A scene camera, or a camera given by numbers. The default is the scene's first camera. If the
/// scene has no camera, or some of the numbers are not given, the camera is placed so that it
/// frames the whole scene.
struct CameraChoice {
    /// The camera's name, or its index in draw order. "light:", followed by a light's name or
    /// index, selects that light. "auto" frames the whole scene, as if it had no camera.
    std::optional<std::string> camera{};
    /// World space; `up` is not 0.
    std::optional<glm::dvec3> eye{}, target{}, up{};
    /// Camera to world, looking along −Z with +Y up (glTF's convention). Replaces `eye`, `target`
    /// and `up`.
    std::optional<glm::dmat4> pose{};
    std::optional<double> fov{};           ///< vertical field of view, degrees
    std::optional<double> ortho_height{};  ///< height of an orthographic picture, scene units
    /// Replaces the field of view of any camera; `size` must have a height. The picture becomes a
    /// crop of a larger picture that is centred on the axis (View::width). View::sample holds the
    /// part of the crop's offset that is less than a pixel.
    std::optional<Intrinsics> intrinsics{};
    std::optional<double> near{}, far{};  ///< distances to the near and far plane, scene units
    Size size{1280, 720};
    std::optional<Window> crop{};  ///< the part of the picture to render, pixels

    /// Whether the camera is built from these numbers rather than taken from the scene.
    bool buildsCamera() const { return eye || target || up || pose || fov || ortho_height; }
};

/// Throws Error (kUsage) if the fields contradict each other. Does not need the scene.
void checkCamera(const CameraChoice& choice);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
