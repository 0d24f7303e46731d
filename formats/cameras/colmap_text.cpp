// SPDX-License-Identifier: Apache-2.0
// COLMAP's cameras.txt, images.txt and points3D.txt.
#include <algorithm>
#include <charconv>

#include "formats/cameras/camera_formats.h"
#include "formats/cameras/colmap_model.h"

namespace peeler {
namespace {

constexpr std::string_view kBlanks = " \t\r";

/// A reader of lines and their words.
class TextLines {
  public:
    TextLines(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

    bool next() {
        if (text_.empty()) return false;
        const std::size_t end = std::min(text_.find('\n'), text_.size());
        line_ = text_.substr(0, end);
        text_.remove_prefix(std::min(end + 1, text_.size()));
        ++number_;
        return true;
    }
    /// Reads the next line that is neither blank nor a comment.
    bool nextOfData() {
        while (next()) {
            const std::size_t begin = line_.find_first_not_of(kBlanks);
            if (begin != std::string_view::npos && line_[begin] != '#') return true;
        }
        return false;
    }
    std::string_view word(const char* what, const char* hint = "") {
        skipBlanks();
        const std::string_view found = line_.substr(0, line_.find_first_of(kBlanks));
        if (found.empty()) refuseCamera("the line ends before " + std::string(what), where(), hint);
        line_.remove_prefix(found.size());
        return found;
    }
    template <class T>
    T number(const char* what, const char* hint = "") {
        const std::string_view text = word(what, hint);
        T value{};
        const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (failure != std::errc() || end != text.data() + text.size())
            refuseCamera("expected " + std::string(what) + ", not \"" +
                             std::string(text.substr(0, 40)) + "\"",
                         where(), hint);
        return value;
    }
    bool hasMore() { return !rest().empty(); }
    /// Returns the rest of the line.
    std::string_view rest() {
        skipBlanks();
        return line_.substr(0, line_.find_last_not_of(kBlanks) + 1);
    }
    std::string where() const { return file_ + ":" + std::to_string(number_); }

  private:
    void skipBlanks() {
        line_.remove_prefix(std::min(line_.find_first_not_of(kBlanks), line_.size()));
    }

    std::string_view text_, line_;
    std::string file_;
    std::uint64_t number_ = 0;
};

std::map<std::uint32_t, ColmapCamera> readCameraLines(const std::filesystem::path& path,
                                                      const CameraFileOptions& options) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(path);
    TextLines lines(asText(bytes), path.string());
    std::map<std::uint32_t, ColmapCamera> cameras;
    while (lines.nextOfData()) {
        checkViewCount(cameras.size() + 1, path.string());
        const auto id = lines.number<std::uint32_t>("a camera's number");
        const std::string_view model = lines.word("a camera model");
        const ColmapLens* const lens = colmapLens(model);
        if (!lens)
            refuseCamera("unknown camera model \"" + std::string(model.substr(0, 40)) + "\"",
                         lines.where());
        const auto width = lines.number<double>("the width"),
                   height = lines.number<double>("the height");
        std::vector<double> parameters;
        for (int k = 0; k < lens->parameters; ++k)
            parameters.push_back(lines.number<double>("a parameter"));
        if (!lines.rest().empty())
            refuseCamera("a " + std::string(lens->name) + " has " +
                             std::to_string(lens->parameters) + " parameters, but there are more",
                         lines.where());
        if (!cameras
                 .emplace(id,
                          colmapCamera(*lens, width, height, parameters, options, lines.where()))
                 .second)
            refuseCamera("camera " + std::to_string(id) + " appears twice", lines.where());
    }
    checkViewCount(cameras.size(), path.string());
    return cameras;
}

/// Skips the line of points after an image, which may be empty. Throws Error (kInput) if the line
/// does not hold points, because a file without these lines has the next image there.
void passPoints(TextLines& lines) {
    if (!lines.next()) return;
    while (lines.hasMore()) {
        constexpr const char* kHint = "add a line of points under each image; it may be empty";
        for (const char* what : {"a point's x", "a point's y"})
            lines.number<double>(what, kHint);
        lines.number<std::int64_t>("a point's id", kHint);
    }
}

std::vector<ColmapImage> readImageLines(const std::filesystem::path& path) {
    const std::vector<std::uint8_t> bytes = readCameraBytes(path);
    TextLines lines(asText(bytes), path.string());
    std::vector<ColmapImage> images;
    while (lines.nextOfData()) {
        checkViewCount(images.size() + 1, path.string());
        ColmapImage& image = images.emplace_back();
        image.id = lines.number<std::uint32_t>("an image's number");
        std::array<double, 7> pose;
        for (double& number : pose)
            number = lines.number<double>("a number of the pose");
        image.camera_to_world = colmapPose(pose, lines.where());
        image.camera = lines.number<std::uint32_t>("a camera's number");
        image.name = lines.rest();
        passPoints(lines);
    }
    return images;
}

}  // namespace

ColmapModel readColmapText(const std::filesystem::path& folder, const CameraFileOptions& options) {
    ColmapModel model{readCameraLines(folder / "cameras.txt", options),
                      readImageLines(folder / "images.txt")};
    std::ranges::sort(model.images, {}, &ColmapImage::id);
    return model;
}

ColmapFiles colmapText(const ColmapModel& model, std::span<const ScenePoint> points) {
    const auto count = [](std::size_t number) { return std::to_string(number) + "\n"; };
    std::string cameras =
        "# Camera list with one line of data per camera:\n"
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
        "# Number of cameras: " +
        count(model.cameras.size());
    for (const auto& [id, camera] : model.cameras) {
        const auto [lens, numbers] = colmapParameters(camera);
        const Size& size = camera.size;
        cameras += std::to_string(id) + " " + std::string(lens->name) + " " +
                   std::to_string(size.width) + " " + std::to_string(size.height) + " " +
                   cameraNumbers(numbers, " ") + "\n";
    }
    std::string images =
        "# Image list with two lines of data per image:\n"
        "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
        "#   POINTS2D[] as (X, Y, POINT3D_ID)\n"
        "# Number of images: " +
        count(model.images.size());
    for (const ColmapImage& image : model.images)
        images += std::to_string(image.id) + " " +
                  cameraNumbers(colmapNumbers(image.camera_to_world), " ") + " " +
                  std::to_string(image.camera) + " " + image.name + "\n\n";
    std::string positions =
        "# 3D point list with one line of data per point:\n"
        "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
        "# Number of points: " +
        count(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& [position, rgb] = points[i];
        positions += std::to_string(i + 1) + " " +
                     cameraNumbers(std::array{position.x, position.y, position.z}, " ");
        for (const std::uint8_t channel : rgb)
            positions += " " + std::to_string(channel);
        positions += " -1\n";
    }
    return {std::move(cameras), std::move(images), std::move(positions)};
}

}  // namespace peeler
