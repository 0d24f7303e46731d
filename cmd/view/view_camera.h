// SPDX-License-Identifier: Apache-2.0
// The camera of a view from layers: the file's own, moved, or one of your own.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "cmd/cli/parse.h"
#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler::cmd {

class VerbOptions;

struct ViewCameraOptions {
    std::optional<glm::dvec3> eye, target, up;
    std::optional<glm::dvec2> orbit;     ///< to the right and upwards, degrees
    std::optional<double> fov;           ///< vertical, degrees
    std::optional<double> ortho_height;  ///< scene units
    std::optional<Size> size;
    std::optional<Window> crop;

    bool changesAnything() const {
        return eye || target || up || orbit || fov || ortho_height || size || crop;
    }
};

/// Declares --eye, --target, --up, --orbit, --fov, --ortho-height, --size and --crop. `options`
/// must outlive the parse.
void addViewCameraOptions(VerbOptions& verb, ViewCameraOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the file is.
void checkViewCameraOptions(const ViewCameraOptions& options);

/// What the picture is about: the point on the viewing axis at medianDepth(), or at 1 if there is
/// none. World space.
glm::dvec3 centerOfInterest(const LayeredImage& image, const View& view);

/// `own`, the file's camera, with what the options change; near plane close enough to clip nothing
/// that the file holds, no far plane. The file's crop stays only while its camera and size do.
/// Throws Error (kUsage) for a camera that cannot be.
View viewFrom(const View& own, const LayeredImage& image, const ViewCameraOptions& options);

}  // namespace peeler::cmd
