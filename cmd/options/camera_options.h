// SPDX-License-Identifier: Apache-2.0
// Which camera and which picture are asked for, and the View that follows.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/parse.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler::cmd {

class VerbOptions;

struct CameraOptions {
    std::optional<std::string> camera;  ///< name or index; none = the first, in draw order
    /// World space; `up` is not 0.
    std::optional<glm::dvec3> eye, target, up;
    std::optional<double> fov;           ///< vertical, degrees
    std::optional<double> ortho_height;  ///< scene units
    std::optional<double> near, far;     ///< scene units
    Size size{1280, 720};
    std::optional<Window> crop;  ///< pixels of the picture
    std::optional<Shard> tile;   ///< of the rows of the crop, or of the picture

    /// Whether a camera is built from these numbers rather than taken from the scene.
    bool buildsCamera() const { return eye || target || up || fov || ortho_height; }
};

/// Declares --camera, --eye, … --crop. `options` must outlive the parse.
void addCameraOptions(VerbOptions& verb, CameraOptions& options);

/// Whether a value of --camera names a light rather than a camera.
bool namesLight(const std::string& camera);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkCameraOptions(const CameraOptions& options);

/// `size`, its height taken from the aspect ratio (width / height) if it has none. Throws Error
/// (kUsage) if the picture would be too high or too large.
Size sizeWithAspect(Size size, double aspect);

/// Throws Error (kUsage) for a crop that reaches outside the picture.
void checkCrop(const Window& crop, int width, int height);

/// What the cameras of the scene are called, in draw order: by their own names, else their nodes',
/// else "camera N".
std::vector<std::string> cameraNames(const PosedScene& posed);

/// The view of the chosen, built or framed camera; `extent` is what it has to see. A scene's camera
/// keeps its vertical field of view whatever the size's aspect ratio, near and far; a built one is
/// near enough to clip nothing it could show (1e-4 of the scene's size or of the distance to the
/// target, which reversed Z makes free) and sees infinitely far, or past the scene if orthographic.
/// Throws Error (kUsage) for an unknown camera, with the list, for a crop outside the picture, and
/// for a camera that cannot be; (kInput) for one that the file gives no direction or no extent.
View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraOptions& options);

}  // namespace peeler::cmd
