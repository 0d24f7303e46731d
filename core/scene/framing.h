// SPDX-License-Identifier: Apache-2.0
// What a camera has to see, and where it stands for that: geometry without options or files.
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

/// How far a scene reaches, at one moment or at all of them.
class SceneExtent {
  public:
    /// Of one moment, by its vertices.
    explicit SceneExtent(const PosedScene& posed);

    /// Of these animations from their first key to their last, by bounding boxes at keys (24 at
    /// most) and between them: the same for every frame, so that a camera which frames the scene
    /// stands still.
    SceneExtent(const Scene& scene, int scene_index, std::span<const int> animations);

    /// A unit cube at the origin if there is nothing. Throws Error (kInput) if it is not finite.
    Bounds bounds() const;

    /// How far it reaches from `origin` along a direction, the largest dot product; −inf if there
    /// is nothing.
    double reach(const glm::dvec3& origin, const glm::dvec3& direction) const;

    /// Which way the triangles face, at the first moment: the sum of their areas as seen against
    /// `direction`, front faces less back faces, as a share of both; −1 to 1, about 0 of what is
    /// closed, and 0 without triangles.
    double facing(const glm::dvec3& direction) const;

  private:
    std::optional<PosedScene> posed_;  ///< at the first moment
    bool moves_ = false;               ///< the boxes count
    std::vector<Bounds> boxes_;
};

/// The world direction from which an unknown scene is looked at: from the front (+Z if `up` is +Y,
/// glTF 2.0 §3.4; −Y if `up` is +Z, as modellers have it), a little from the right and from above.
glm::dvec3 pleasingForward(const glm::dvec3& up);

/// How an unknown scene is looked at: a viewing direction, and what is upwards in the picture.
struct FramingDirection {
    glm::dvec3 forward, up;
};

/// From the front what is flat (thinner than a twentieth of its second-smallest extent, along an
/// axis): along that axis, from the side where pleasingForward() stands, unless most of its
/// triangles show their backs there. From above, with `up` across it, as a map with what is far
/// upwards. All else along pleasingForward().
FramingDirection framingDirection(const SceneExtent& extent, const glm::dvec3& up);

/// The largest extent of the bounds; a length that suits the place if they have none.
double sceneSize(const Bounds& bounds);

/// How far a scene reaches from an origin along a direction: the largest dot product.
using Reach = std::function<double(const glm::dvec3& direction)>;

/// What stays free at each end of the side of a picture that decides how near a camera may stand,
/// as a share of that side.
inline constexpr double kFramingMargin = 0.05;

/// The eye of a camera that looks along `forward`, relative to the origin of `reach`, so near that
/// the scene just fits into the frame with margins of kFramingMargin. `centred` keeps the origin in
/// the middle of the picture, otherwise the scene is. An orthographic frame has its size given; the
/// eye is just placed in front. `size` is the scene's, for what has no extent.
glm::dvec3 framingEye(const Reach& reach, double size, bool centred, const glm::dvec3& forward,
                      const glm::dvec3& up, const Projection& projection);

/// Depth along the viewing axis, positive in front of the camera, of the nearest and the farthest
/// corner of bounds; scene units.
struct DepthRange {
    double nearest = 0, farthest = 0;
};
DepthRange depthRange(const Bounds& bounds, const glm::dmat4& camera_to_world);

// camera_choice.cpp.

/// What the cameras of the scene are called, in draw order: by their own names, else their nodes',
/// else "camera N".
std::vector<std::string> cameraNames(const PosedScene& posed);

/// The view of the chosen, built or framed camera; `extent` is what it has to see. A scene's camera
/// keeps its vertical field of view whatever the size's aspect ratio, near and far; a built one is
/// near enough to clip nothing it could show (1e-4 of the scene's size or of the distance to the
/// target, which reversed Z makes free) and sees infinitely far, or past the scene if orthographic.
/// Throws Error (kUsage) for an unknown camera, with the list, for a crop outside the picture, and
/// for a camera that cannot be; (kInput) for one that the file gives no direction or no extent.
View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraChoice& choice);

}  // namespace peeler
