// SPDX-License-Identifier: Apache-2.0
// COLMAP's cameras.bin, images.bin and points3D.bin: little-endian, without padding.
#include <algorithm>
#include <bit>
#include <cstring>

#include "formats/cameras/camera_formats.h"
#include "formats/cameras/colmap_model.h"

namespace peeler {
namespace {

static_assert(std::endian::native == std::endian::little);

/// A sequential reader of a binary file.
class ColmapBytes {
  public:
    ColmapBytes(std::span<const std::uint8_t> bytes, std::string file)
        : bytes_(bytes), file_(std::move(file)) {}

    template <class T>
    T take() {
        T value;
        std::memcpy(&value, part(sizeof value).data(), sizeof value);
        return value;
    }
    template <std::size_t kCount>
    std::array<double, kCount> takeNumbers() {
        std::array<double, kCount> numbers;
        for (double& number : numbers)
            number = take<double>();
        return numbers;
    }
    /// Reads the number of records. Throws Error (kInput) if the rest of the file is smaller than
    /// this number of records of at least `least` bytes.
    std::uint64_t takeCount(std::uint64_t least) {
        const std::string place = where();
        const auto count = take<std::uint64_t>();
        if (count > (bytes_.size() - at_) / least)
            refuseCamera("the file is too small for the " + std::to_string(count) +
                             " entries that it declares",
                         place, "copy or export the file again");
        return count;
    }
    std::string takeText() {
        const auto rest = bytes_.subspan(at_);
        const auto end = std::ranges::find(rest, 0);
        if (end == rest.end()) endsEarly();
        std::string text(rest.begin(), end);
        at_ += text.size() + 1;
        return text;
    }
    void skip(std::uint64_t count) { part(count); }
    void end() const {
        if (at_ != bytes_.size()) refuseCamera("data follows the last number", where());
    }
    std::string where() const { return file_ + ", byte " + std::to_string(at_); }

  private:
    [[noreturn]] void endsEarly() const {
        refuseCamera("the file ends early", where(), "copy or export the file again");
    }
    std::span<const std::uint8_t> part(std::uint64_t count) {
        if (count > bytes_.size() - at_) endsEarly();
        at_ += count;
        return bytes_.subspan(at_ - count, count);
    }

    std::span<const std::uint8_t> bytes_;
    std::string file_;
    std::uint64_t at_ = 0;
};

std::map<std::uint32_t, ColmapCamera> readCamerasFile(const std::filesystem::path& path,
                                                      const CameraFileOptions& options) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(path);
    ColmapBytes file(bytes, path.string());
    // Minimum bytes per camera: id, model, width and height.
    constexpr std::uint64_t kLeastCamera = 24;
    const std::uint64_t count = file.takeCount(kLeastCamera);
    checkViewCount(count, path.string());
    std::map<std::uint32_t, ColmapCamera> cameras;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::string where = file.where();
        const auto id = file.take<std::uint32_t>();
        const auto model = file.take<std::int32_t>();
        const auto width = file.take<std::uint64_t>(), height = file.take<std::uint64_t>();
        const ColmapLens* const lens = colmapLens(model);
        if (!lens) refuseCamera("unknown camera model " + std::to_string(model), where);
        std::vector<double> parameters;
        for (int k = 0; k < lens->parameters; ++k)
            parameters.push_back(file.take<double>());
        const ColmapCamera camera =
            colmapCamera(*lens, static_cast<double>(width), static_cast<double>(height), parameters,
                         options, where);
        if (!cameras.emplace(id, camera).second)
            refuseCamera("camera " + std::to_string(id) + " appears twice", where);
    }
    file.end();
    return cameras;
}

std::vector<ColmapImage> readImagesFile(const std::filesystem::path& path) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(path);
    ColmapBytes file(bytes, path.string());
    // Minimum bytes per image: id, pose, camera, terminating zero of the name, number of points.
    constexpr std::uint64_t kLeastImage = 73;
    constexpr std::uint64_t kPoint = 24;  // bytes per point: x, y, point id
    const std::uint64_t count = file.takeCount(kLeastImage);
    checkViewCount(count, path.string());
    std::vector<ColmapImage> images(count);
    for (ColmapImage& image : images) {
        const std::string where = file.where();
        image.id = file.take<std::uint32_t>();
        image.camera_to_world = colmapPose(file.takeNumbers<7>(), where);
        image.camera = file.take<std::uint32_t>();
        image.name = file.takeText();
        file.skip(file.takeCount(kPoint) * kPoint);
    }
    file.end();
    return images;
}

class BinaryText {
  public:
    template <class T>
    BinaryText& add(const T& value) {
        text_.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    BinaryText& addText(const std::string& text) {
        text_.append(text.c_str(), text.size() + 1);
        return *this;
    }
    std::string take() { return std::move(text_); }

  private:
    std::string text_;
};

}  // namespace

ColmapModel readColmapBinary(const std::filesystem::path& folder,
                             const CameraFileOptions& options) {
    ColmapModel model{readCamerasFile(folder / "cameras.bin", options),
                      readImagesFile(folder / "images.bin")};
    std::ranges::sort(model.images, {}, &ColmapImage::id);
    return model;
}

ColmapFiles colmapBinary(const ColmapModel& model, std::span<const ScenePoint> points) {
    BinaryText cameras, images, positions;
    cameras.add(std::uint64_t{model.cameras.size()});
    for (const auto& [id, camera] : model.cameras) {
        const auto [lens, numbers] = colmapParameters(camera);
        const Size& size = camera.size;
        cameras.add(id).add(std::int32_t{lens->id});
        cameras.add(std::uint64_t(size.width)).add(std::uint64_t(size.height));
        for (const double number : numbers)
            cameras.add(number);
    }
    images.add(std::uint64_t{model.images.size()});
    for (const ColmapImage& image : model.images) {
        images.add(image.id).add(colmapNumbers(image.camera_to_world)).add(image.camera);
        images.addText(image.name).add(std::uint64_t{0});
    }
    positions.add(std::uint64_t{points.size()});
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& [position, rgb] = points[i];
        constexpr double kErrorUnknown = -1;
        positions.add(std::uint64_t{i + 1}).add(std::array{position.x, position.y, position.z});
        positions.add(rgb).add(kErrorUnknown).add(std::uint64_t{0});
    }
    return {cameras.take(), images.take(), positions.take()};
}

}  // namespace peeler
