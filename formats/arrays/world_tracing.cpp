// SPDX-License-Identifier: Apache-2.0
// Writer of World Tracing samples: picture, and points of the layers in camera space. Shapes, axes
// and values are those of haoz19/world-tracing: wt/data.py (load_video_clip() and
// preprocess_clip_for_model(), pictures and intrinsics) and wt/inference.py (xyz, masks).
#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>

#include <peeler/camera_choice.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/atomic_file.h"
#include "formats/image/image_writer.h"

namespace peeler {
namespace {

constexpr std::uint32_t kTracedLayers = 6;
enum TracedArray : std::size_t { kTracedPoints, kTracedMasks, kTracedPose, kTracedIntrinsics };

using PointXyz = std::array<float, 3>;

std::vector<NamedArray> tracedArrays(const Plan& plan) {
    const Window& crop = plan.view.crop;
    const auto height = static_cast<std::uint64_t>(crop.height());
    const auto width = static_cast<std::uint64_t>(crop.width());
    std::vector<NamedArray> arrays = {
        {"xyz", NumberType::kFloat, {kTracedLayers, height, width, 3}},
        {"mask", NumberType::kUint8, {kTracedLayers, height, width}},
        {"world_to_camera", NumberType::kDouble, {4, 4}}};
    if (plan.view.projection.perspective) arrays.push_back({"K", NumberType::kDouble, {3, 3}});
    return arrays;
}

SizeForecast tracedForecast(const std::string& path, const Plan& plan, bool compress) {
    return ArrayWriter::forecast(worldTracingFiles(path).at(0), tracedArrays(plan), {}, compress);
}

/// Returns the point at depth `z` behind the position (x, y) in the picture, in pixels. Camera
/// space has OpenCV's axes.
PointXyz cameraPoint(const View& view, double x, double y, double z) {
    const Projection& projection = view.projection;
    const double scale = projection.perspective ? z : 1;
    return {static_cast<float>(projection.half_width * (2 * x / view.width - 1) * scale),
            static_cast<float>(projection.half_height * (2 * y / view.height - 1) * scale),
            static_cast<float>(z)};
}

class WorldTracingSample final : public Sink {
  public:
    WorldTracingSample(const std::string& path, const OutputOptions& options)
        : path_(path),
          compress_(options.compress),
          picture_(path, options, PictureAlpha::kAnyFragment) {}

    void begin(const Plan& plan) override {
        if (isStandardOutput(path_)) {
            throw Error(ErrorKind::kUsage, "standard output takes one file",
                        Parameter::kAs + " world-tracing", "name a file");
        }
        view_ = plan.view;
        points_.emplace(worldTracingFiles(path_).at(0), tracedArrays(plan), ArrayTexts{},
                        compress_);
        writeCamera();
        picture_.begin(plan);
    }

    void write(LayeredImage&& band) override {
        parallelFor(kTracedLayers, [&](std::size_t layer) { writeLayer(band, layer); });
        pixels_ += band.window.pixels();
        picture_.write(std::move(band));
    }

    void finish() override {
        // commitAll() renames the first file last. So if the picture exists, the points exist.
        const std::array<AtomicFile*, 2> files = {&picture_.close(), &points_->close()};
        commitAll(files);
    }

    SinkMemory memory(const Plan& plan) const override {
        SinkMemory memory = picture_.memory(plan);
        memory.bytes += static_cast<std::uint64_t>(threadCount()) * kPixelsAtOnce *
                        (sizeof(PointXyz) + sizeof(std::uint8_t));
        if (compress_)
            memory.bytes += ArrayWriter::compressionBytes(tracedForecast(path_, plan, true));
        return memory;
    }
    StageTimes times() const override { return picture_.times(); }

  private:
    static constexpr std::size_t kPixelsAtOnce = std::size_t{1} << 15;

    void writeCamera() {
        glm::dmat4 rows = glm::transpose(glm::inverse(view_.camera_to_world));
        rows[1] = -rows[1];  // y down
        rows[2] = -rows[2];  // z forward
        points_->append(kTracedPose, std::as_bytes(std::span(&rows, 1)));
        if (!view_.projection.perspective) return;
        const Intrinsics k = intrinsicsOf(view_);
        points_->append(kTracedIntrinsics,
                        asBytes(std::array<double, 9>{k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1}));
    }

    void writeLayer(const LayeredImage& band, std::size_t layer) {
        const auto width = static_cast<std::size_t>(band.window.width());
        const std::uint64_t before = layer * view_.crop.pixels() + pixels_;
        std::vector<PointXyz> points;
        std::vector<std::uint8_t> masks;
        for (std::size_t first = 0; first < band.window.pixels(); first += kPixelsAtOnce) {
            const std::size_t last = std::min(first + kPixelsAtOnce, band.window.pixels());
            points.assign(last - first, {});
            masks.assign(last - first, 0);
            for (std::size_t p = first; p < last; ++p) {
                if (band.count(p) <= layer) continue;
                const double x = static_cast<double>(p % width) + band.window.x0 + view_.sample.x;
                const std::size_t row = p / width;
                const double y = static_cast<double>(row) + band.window.y0 + view_.sample.y;
                points[p - first] =
                    cameraPoint(view_, x, y, static_cast<double>(band.z[band.offsets[p] + layer]));
                masks[p - first] = 1;
            }
            points_->writeAt(kTracedPoints, (before + first) * sizeof(PointXyz), asBytes(points));
            points_->writeAt(kTracedMasks, before + first, asBytes(masks));
        }
    }

    std::string path_;
    bool compress_ = false;
    ImageWriter picture_;
    View view_;
    std::optional<ArrayWriter> points_;
    std::uint64_t pixels_ = 0;  ///< number of pixels written so far
};

}  // namespace

std::vector<std::string> worldTracingFiles(const std::string& path) {
    return {std::filesystem::path(path).replace_extension().string() + "_xyz.npz"};
}

std::unique_ptr<Sink> makeWorldTracingSample(const std::string& path,
                                             const OutputOptions& options) {
    return std::make_unique<WorldTracingSample>(path, options);
}

SizeForecast forecastWorldTracingSample(const std::string& path, const Plan& plan,
                                        const OutputOptions& options) {
    SizeForecast bytes = tracedForecast(path, plan, options.compress);
    bytes += imageForecast(path, plan.view.crop.pixels());
    return bytes;
}

}  // namespace peeler
