// SPDX-License-Identifier: Apache-2.0
// Output of --cameras-out: the cameras of all views and, for COLMAP, scene points.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include "formats/cameras/camera_file.h"

namespace peeler::cmd {

/// The maximum number of points in a model. Each picture of the run contributes at most an equal
/// share.
inline constexpr std::size_t kMostScenePoints = 100'000;

/// A collector of the views' cameras, and of points from the pictures' fragments.
class UsedCameras {
  public:
    /// `pictures` is the number of pictures in the run. Throws like checkCameraOutput().
    UsedCameras(std::filesystem::path path, std::size_t pictures);

    void add(const View& view, const std::filesystem::path& picture);
    /// Returns a sink that collects points and forwards the bands to `sink`. Returns `sink` itself
    /// if the camera format has no points. This object must outlive the returned sink.
    std::unique_ptr<Sink> watched(std::unique_ptr<Sink> sink);
    /// Writes the camera file. Throws like writeCameras().
    void write() const;

  private:
    class PointTaker;

    std::filesystem::path path_;
    std::size_t points_a_picture_;
    std::vector<FileCamera> cameras_;
    std::vector<ScenePoint> points_;
};

}  // namespace peeler::cmd
