// SPDX-License-Identifier: Apache-2.0
// Automatic camera framing: the geometry, without options or files.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/camera_choice.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// The extent of a scene, at one moment or over its animations.
class SceneExtent {
  public:
    /// Measures the vertices in this pose.
    explicit SceneExtent(const PosedScene& posed);

    /// Measures the extent over these animations, from the first key to the last, by bounding boxes
    /// at up to 24 keys and at evenly spaced times. The extent is the same for every frame, so a
    /// camera that frames the scene does not move.
    SceneExtent(const Scene& scene, int scene_index, std::span<const int> animations);

    /// Returns the bounds; a unit cube at the origin if the scene is empty. Throws Error (kInput)
    /// if the bounds are not finite.
    Bounds bounds() const;

    /// Returns the maximum of dot(direction, p − origin) over all points p; −inf if the scene is
    /// empty.
    double reach(const glm::dvec3& origin, const glm::dvec3& direction) const;

    /// Rotates all points about the vertical axis through `centre` into one half-plane. Returns the
    /// corners of the rotated points' convex hull: distance from the axis, and height above
    /// `centre`. Empty if the scene is empty.
    std::vector<glm::dvec2> profile(const glm::dvec3& centre) const;

    /// Returns the mean facing of the triangles at the first moment, −1 to 1: their projected areas
    /// as seen from `direction`, front faces minus back faces, divided by the sum of both. About 0
    /// for closed surfaces; 0 if there are no triangles.
    double facing(const glm::dvec3& direction) const;

  private:
    std::optional<PosedScene> posed_;  ///< the scene at the first moment
    bool moves_ = false;               ///< whether boxes_ are measured instead of vertices
    std::vector<Bounds> boxes_;
};

/// Returns the default viewing direction, in world space: from the front, slightly from the right
/// and from above. The front is +Z if `up` is +Y (glTF 2.0 §3.4), and −Y if `up` is +Z, as in
/// modelling programs.
glm::dvec3 pleasingForward(const glm::dvec3& up);

/// A viewing direction, and the picture's up vector.
struct FramingDirection {
    glm::dvec3 forward, up;
};

/// Returns the direction from which to frame a scene. A flat scene (along one axis, thinner than a
/// twentieth of its second-smallest extent) is seen along this axis, from the side of
/// pleasingForward(), or from the other side if most of its triangles face there. If `up` is this
/// axis, the scene is seen from above, like a map with the far side at the top. All other scenes
/// are seen along pleasingForward().
FramingDirection framingDirection(const SceneExtent& extent, const glm::dvec3& up);

/// Returns the diagonal of the bounds. If it is 0, returns a length that suits the position.
double sceneSize(const Bounds& bounds);

/// A function that returns the reach of a scene along a direction: the maximum dot product of the
/// direction with the scene's points, relative to an origin.
using Reach = std::function<double(const glm::dvec3& direction)>;

/// The margin at either end of the picture's width or height, as a fraction of that width or
/// height. Only the dimension that limits the camera's distance has exactly these margins.
inline constexpr double kFramingMargin = 0.05;

/// Returns the eye of a camera that looks along `forward`, relative to the origin of `reach`. A
/// perspective camera is as near as margins of kFramingMargin allow. An orthographic camera's frame
/// is fixed, so its eye is only placed in front of the scene. If `centred`, the origin is in the
/// middle of the picture; otherwise the scene is. `size` is sceneSize(), which gives a distance for
/// scenes without an extent.
glm::dvec3 framingEye(const Reach& reach, double size, bool centred, const glm::dvec3& forward,
                      const glm::dvec3& up, const Projection& projection);

/// The depths of the nearest and farthest corner of bounds along the viewing axis, positive in
/// front of the camera; scene units.
struct DepthRange {
    double nearest = 0, farthest = 0;
};
DepthRange depthRange(const Bounds& bounds, const glm::dmat4& camera_to_world);

// Defined in camera_choice.cpp.

/// Returns the names of the scene's cameras, in draw order. A camera without a name gets its node's
/// name. If the node has no name either, the camera is called "camera N".
std::vector<std::string> cameraNames(const PosedScene& posed);

/// Returns the view of the chosen, built or framed camera. `extent` is the scene to show. A scene's
/// camera keeps its near and far planes and, at any aspect ratio, its vertical field of view. A
/// built camera's near plane clips nothing visible: it is at 1e-4 of the smaller of the scene's
/// size and the distance to the target (with reversed Z, this costs no precision). A built camera
/// has no far plane or, if orthographic, a far plane beyond the scene. Throws Error (kUsage) if the
/// camera is unknown, with the list of cameras, if the crop is outside the picture, or if the
/// camera is impossible; (kInput) if the file gives the camera no direction or no extent.
View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraChoice& choice);

}  // namespace peeler
