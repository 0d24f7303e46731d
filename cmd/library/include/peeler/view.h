// SPDX-License-Identifier: Apache-2.0
// Camera views: pose, projection, display window, crop.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <peeler/window.h>

namespace peeler {
class PictureRays;  // core/lens/picture_rays.h; not exported
}

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Returns the camera-to-world matrix of a camera or light at `eye` that looks along `forward`,
/// with `up` upwards in the picture. Returns nothing if `forward` and `up` are parallel, or if the
/// length of either is 0.
std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up);

/// Returns the rotation and translation of a node's matrix, which may also scale, mirror and shear.
/// The viewing axis (−Z) keeps its direction, +Y stays on the same side of the axis, and the
/// picture is never mirrored. Returns nothing if the matrix collapses the viewing direction.
std::optional<glm::dmat4> rigid(const glm::dmat4& world);

/// The view frustum (perspective) or box (orthographic) of a camera that looks along −Z in camera
/// space (glTF's convention). `half_width` and `half_height` are measured at distance 1 for a
/// perspective camera (tan of half the field of view) and in scene units for an orthographic one.
struct Projection {
    bool perspective = true;
    double half_width = 1, half_height = 1;
    double near = 0.01;
    /// Distance to the far plane; finite if orthographic.
    double far = std::numeric_limits<double>::infinity();

    /// Returns the clip-space matrix (column vectors, reversed Z in [0, 1]: 1 at near, 0 at far) of
    /// the sub-rectangle [u0, u1] × [v0, v1] of the picture. u points right, v down; both are 0–1.
    glm::dmat4 matrix(double u0 = 0, double v0 = 0, double u1 = 1, double v1 = 1) const;

    /// Returns the camera Z (positive in front, scene units) of a buffer depth. Decreases
    /// monotonically: a larger depth never gives a larger Z.
    double linearZ(double depth) const;
    /// Converts depths to camera Z in place, rounded to float.
    void toLinearZ(std::span<float> depths) const;
};

/// A posed camera and its picture: the mapping from pixels to rays.
struct View {
    /// Name of the scene's camera; "" for a camera that is not in the scene.
    std::string camera_name;
    glm::dmat4 camera_to_world{1};  ///< rigid: rotation and translation only
    Projection projection;
    int width = 1280, height = 720;  ///< size of the display window, pixels
    Window crop;                     ///< the rendered pixels, inside the display window
    glm::dvec2 sample{0.5};          ///< position of the sample within a pixel, 0–1, y down
    bool known = true;               ///< false = the file has no camera, only windows
    /// The rays of a lens, of a moving camera, or of a list; null for a pinhole and for parallel
    /// rays. If set, `projection` is that of a pinhole camera and defines only the depth range, Z
    /// and the range are distances along the rays, and the CPU finds the fragments.
    std::shared_ptr<const PictureRays> rays{};
};

/// Returns the world-space point at camera Z `z` (scene units) on the ray through (x, y). `x` and
/// `y` are in pixels from the upper left corner of the display window, y down. The centre of pixel
/// (i, j) is (i + 0.5, j + 0.5), and the pixel's sample is at (i, j) + `view.sample`.
glm::dvec3 worldPosition(const View& view, double x, double y, double z);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
