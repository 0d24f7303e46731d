// SPDX-License-Identifier: Apache-2.0
// What --cameras-out writes: the cameras of all views, and of COLMAP points of what they see.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include "formats/cameras/camera_file.h"

namespace peeler::cmd {

/// The most points of a model, shared alike by the pictures of a run.
inline constexpr std::size_t kMostScenePoints = 100'000;

/// Collects cameras, and, as layers pass by, points of their fragments.
class UsedCameras {
  public:
    /// Throws like checkCameraOutput(). `pictures`: how many pass by.
    UsedCameras(std::filesystem::path path, std::size_t pictures);

    /// A view and the file of its picture.
    void add(const View& view, const std::filesystem::path& picture);
    /// `sink`, before which the points are taken; itself if the format has no place for them. This
    /// object must outlive it.
    std::unique_ptr<Sink> watched(std::unique_ptr<Sink> sink);
    /// Throws like writeCameras().
    void write() const;

  private:
    class PointTaker;

    std::filesystem::path path_;
    std::size_t points_a_picture_;
    std::vector<FileCamera> cameras_;
    std::vector<ScenePoint> points_;
};

}  // namespace peeler::cmd
