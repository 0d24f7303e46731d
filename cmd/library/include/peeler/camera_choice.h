// SPDX-License-Identifier: Apache-2.0
// The choice of a camera: one of the scene, one of a light, or one built from numbers.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>

#include <peeler/view.h>
#include <peeler/window.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Pixels of a picture.
struct Size {
    int width = 0;
    int height = 0;  ///< 0: from the width and the camera's aspect ratio
    bool operator==(const Size&) const = default;
};

/// A pinhole camera as it was calibrated, in pixels: what lies at (x, y, z) in front of it (x to
/// the right, y down, z forward) is seen at (fx · x / z + cx, fy · y / z + cy), where (0, 0) is the
/// centre of the upper left pixel (OpenCV's convention; add 0.5 to cx and cy of programs that have
/// that pixel's upper left corner at (0, 0)).
struct Intrinsics {
    double fx = 1, fy = 1, cx = 0, cy = 0;
    bool operator==(const Intrinsics&) const = default;
};

/// The intrinsics of what a view renders, its crop as a picture of its own: those that
/// CameraChoice::intrinsics made it of, or, where several make the same view to the last bit, the
/// ones with the fewest digits. A view that was made of a field of view may have half widths that
/// no focal length leads to; then they are of the nearest one. Throws Error (kUsage) for an
/// orthographic view.
Intrinsics intrinsicsOf(const View& view);

/// A camera of the scene, or one built from numbers. Without either it is the scene's first camera.
/// If the scene has none, and for each number that a built camera lacks, the whole scene is framed.
struct CameraChoice {
    std::optional<std::string> camera{};  ///< name, or index in draw order; "light:" and a light's
    /// World space; `up` is not 0.
    std::optional<glm::dvec3> eye{}, target{}, up{};
    /// Camera to world: it looks along −Z with +Y up, as cameras of glTF do. In place of the three.
    std::optional<glm::dmat4> pose{};
    std::optional<double> fov{};           ///< vertical, degrees
    std::optional<double> ortho_height{};  ///< scene units
    /// In place of a field of view, of whichever camera; `size` has a height then. The picture is a
    /// crop of a larger one whose middle is on the axis (View::width), and View::sample says where
    /// the axis goes through its pixel.
    std::optional<Intrinsics> intrinsics{};
    std::optional<double> near{}, far{};  ///< scene units
    Size size{1280, 720};
    std::optional<Window> crop{};  ///< pixels of the picture

    /// Whether a camera is built from these numbers rather than taken from the scene.
    bool buildsCamera() const { return eye || target || up || pose || fov || ortho_height; }
};

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkCamera(const CameraChoice& choice);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
