// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/used_cameras.h"

#include <algorithm>
#include <utility>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include "formats/image/display.h"

namespace peeler::cmd {

/// A sink that forwards bands and collects points. Takes every n-th fragment, not random ones, so
/// that equal pictures give equal points.
class UsedCameras::PointTaker final : public Sink {
  public:
    PointTaker(std::unique_ptr<Sink> next, std::size_t most, std::vector<ScenePoint>& points)
        : next_(std::move(next)), most_(most), points_(points) {}

    void begin(const Plan& plan) override {
        view_ = plan.view;
        every_ = plan.fragments_stored / most_ + 1;
        next_->begin(plan);
    }
    void write(LayeredImage&& band) override {
        take(band);
        next_->write(std::move(band));
    }
    void finish() override { next_->finish(); }
    SinkMemory memory(const Plan& plan) const override {
        SinkMemory memory = next_->memory(plan);
        memory.bytes += most_ * sizeof(ScenePoint);
        return memory;
    }
    StageTimes times() const override { return next_->times(); }

  private:
    void take(const LayeredImage& band) {
        const auto width = static_cast<std::size_t>(band.window.width());
        for (std::size_t pixel = 0; pixel + 1 < band.offsets.size(); ++pixel) {
            for (std::size_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f) {
                if (passed_++ % every_ != 0) continue;
                const std::size_t row = pixel / width, column = pixel % width;
                const double x = static_cast<double>(column) + band.window.x0;
                const double y = static_cast<double>(row) + band.window.y0;
                const auto [r, g, b, a] = displayColor(colorOf(band, f));
                points_.push_back({worldPosition(view_, x + view_.sample.x, y + view_.sample.y,
                                                 static_cast<double>(band.z[f])),
                                   {r, g, b}});
            }
        }
    }

    std::unique_ptr<Sink> next_;
    std::size_t most_;
    std::vector<ScenePoint>& points_;
    View view_;
    std::uint64_t every_ = 1, passed_ = 0;
};

UsedCameras::UsedCameras(std::filesystem::path path, std::size_t pictures)
    : path_(std::move(path)),
      points_a_picture_(
          std::max<std::size_t>(1, kMostScenePoints / std::max<std::size_t>(1, pictures))) {
    checkCameraOutput(path_.string());
}

void UsedCameras::add(const View& view, const std::filesystem::path& picture) {
    FileCamera camera = fileCamera(view, view.camera_name);
    // Camera files contain the pictures' paths relative to the camera file.
    const std::filesystem::path folder = std::filesystem::absolute(path_).parent_path();
    camera.picture = std::filesystem::absolute(picture).lexically_relative(folder).string();
    cameras_.push_back(std::move(camera));
}

std::unique_ptr<Sink> UsedCameras::watched(std::unique_ptr<Sink> sink) {
    if (!holdsScenePoints(path_.string())) return sink;
    return std::make_unique<PointTaker>(std::move(sink), points_a_picture_, points_);
}

void UsedCameras::write() const {
    writeCameras(path_.string(), cameras_, {.points = points_});
}

}  // namespace peeler::cmd
