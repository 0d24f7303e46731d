// SPDX-License-Identifier: Apache-2.0
// Writer of LaRI samples: picture, depths of the layers, pose. The loader that reads them consists
// of src/datasets/objaverse.py, src/datasets/gso.py and src/utils/geometry.py; the authors' writers
// are dataset_curation/ldi_render_per_object.py (depths) and
// dataset_curation/objaverse/zero123_blender_script.py (pictures and poses).
#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>

#include <peeler/error.h>
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/atomic_file.h"
#include "formats/image/image_writer.h"

namespace peeler {
namespace {

constexpr std::uint32_t kLariLayers = 15;
constexpr DensePlanes::Column kLariDepth{NumberType::kFloat, 1};

DensePlanes lariPlanes() {
    return {DenseSettings{.type = PixelType::kHalf, .fill = -1}, kLariLayers};
}

std::vector<NamedArray> lariArrays(const Plan& plan) {
    const Window& crop = plan.view.crop;
    return {lariPlanes().array(
        "ldi", kLariDepth,
        {static_cast<std::uint64_t>(crop.height()), static_cast<std::uint64_t>(crop.width())})};
}

/// Returns the matrix from Blender's world to the camera, as 3 rows of 4. Blender's world has +Z
/// up: our (x, y, z) is Blender's (x, −z, y). Blender's cameras look along −Z with +Y up, as in
/// glTF.
std::array<double, 12> blenderPose(const View& view) {
    const glm::dmat4 to_gltf{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}};
    const glm::dmat4 pose = glm::inverse(view.camera_to_world) * to_gltf;
    std::array<double, 12> rows{};
    std::size_t next = 0;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            rows[next++] = pose[column][row];
    return rows;
}

const NamedArray kLariPose{"", NumberType::kDouble, {3, 4}};

SizeForecast depthForecast(const std::string& path, const Plan& plan, bool compress) {
    return ArrayWriter::forecast(lariFiles(path).at(0), lariArrays(plan), {}, compress);
}

class LariSample final : public Sink {
  public:
    LariSample(const std::string& path, const OutputOptions& options)
        : path_(path),
          compress_(options.compress),
          picture_(path, options, PictureAlpha::kAnyFragment) {}

    void begin(const Plan& plan) override {
        if (isStandardOutput(path_)) {
            throw Error(ErrorKind::kUsage, "several files cannot go to standard output",
                        Parameter::kAs + " lari", "name a file");
        }
        const std::vector<std::string> beside = lariFiles(path_);
        depths_.emplace(beside.at(0), lariArrays(plan), ArrayTexts{}, compress_);
        pose_.emplace(beside.at(1));
        pose_->append(asBytes(npyHeader(kLariPose)));
        pose_->append(asBytes(blenderPose(plan.view)));
        picture_.begin(plan);
    }

    void write(LayeredImage&& band) override {
        const std::size_t pixel = planes_.pixelBytes(kLariDepth);
        DensePlanes::forEachRange(band.offsets, pixel, [&](std::size_t first, std::size_t last) {
            ByteBuffer planes;
            const std::span offsets = std::span(band.offsets).subspan(first, last - first + 1);
            const std::span z =
                std::span(band.z).subspan(offsets.front(), offsets.back() - offsets.front());
            planes_.fill(kLariDepth, offsets, std::as_bytes(z), planes);
            depths_->writeAt(0, (pixels_ + first) * pixel, planes);
        });
        pixels_ += band.window.pixels();
        picture_.write(std::move(band));
    }

    void finish() override {
        // commitAll() renames the first file last. So if the picture exists, the other files exist.
        const std::array<AtomicFile*, 3> files = {&picture_.close(), &depths_->close(), &*pose_};
        commitAll(files);
    }

    SinkMemory memory(const Plan& plan) const override {
        SinkMemory memory = picture_.memory(plan);
        memory.bytes += DensePlanes::rangeBytes();
        if (compress_)
            memory.bytes += ArrayWriter::compressionBytes(depthForecast(path_, plan, true));
        return memory;
    }
    StageTimes times() const override { return picture_.times(); }

  private:
    std::string path_;
    bool compress_ = false;
    DensePlanes planes_ = lariPlanes();
    ImageWriter picture_;
    std::optional<ArrayWriter> depths_;
    std::optional<AtomicFile> pose_;
    std::uint64_t pixels_ = 0;  ///< number of pixels written so far
};

}  // namespace

std::vector<std::string> lariFiles(const std::string& path) {
    const std::string stem = std::filesystem::path(path).replace_extension().string();
    return {stem + "_ldi.npz", stem + ".npy"};
}

std::unique_ptr<Sink> makeLariSample(const std::string& path, const OutputOptions& options) {
    return std::make_unique<LariSample>(path, options);
}

SizeForecast forecastLariSample(const std::string& path, const Plan& plan,
                                const OutputOptions& options) {
    SizeForecast bytes = depthForecast(path, plan, options.compress);
    bytes.bytes += npyHeader(kLariPose).size() + kLariPose.bytes();
    bytes += imageForecast(path, plan.view.crop.pixels());
    return bytes;
}

}  // namespace peeler
