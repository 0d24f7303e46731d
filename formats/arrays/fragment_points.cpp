// SPDX-License-Identifier: Apache-2.0
// Writes fragments as a .ply.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/byte_buffer.h"
#include "formats/image/image_writer.h"

namespace peeler {
namespace {

/// A premultiplied linear colour as viewers of point clouds show it: straight, sRGB-encoded, 8
/// bits.
std::array<std::uint8_t, 4> displayColor(const std::array<float, 4>& color) {
    const float alpha = color[3], scale = alpha > 0 ? 1 / alpha : 0;
    const auto byte = [](float value) {
        return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0F, 1.0F)));
    };
    return {byte(encodeSrgb(color[0] * scale)), byte(encodeSrgb(color[1] * scale)),
            byte(encodeSrgb(color[2] * scale)), byte(alpha > 0 ? alpha : 0)};
}

class FragmentPoints final : public Sink {
  public:
    FragmentPoints(std::string path, FragmentPointOptions options)
        : path_(std::move(path)), options_(std::move(options)) {}

    void begin(const Plan& plan) override { view_ = plan.view; }
    void write(LayeredImage&& band) override;
    void finish() override { writer_->finish(); }

  private:
    void open(const LayeredImage& band);

    std::string path_;
    FragmentPointOptions options_;
    View view_;
    std::vector<std::string> normal_, numbers_;  ///< names of channels
    std::optional<PlyWriter> writer_;            ///< from the first band on
    std::vector<std::byte> points_;
};

void FragmentPoints::open(const LayeredImage& band) {
    const NumberType position =
        options_.double_positions ? NumberType::kDouble : NumberType::kFloat;
    std::vector<PlyProperty> properties = {{"x", position}, {"y", position}, {"z", position}};
    for (const std::string prefix : {"N", "Ng"}) {
        if (!findChannel(band, prefix + ".X") || !findChannel(band, prefix + ".Y") ||
            !findChannel(band, prefix + ".Z"))
            continue;
        normal_ = {prefix + ".X", prefix + ".Y", prefix + ".Z"};
        for (const char* name : {"nx", "ny", "nz"})
            properties.push_back({name, NumberType::kFloat});
        break;
    }
    for (const char* name : {"red", "green", "blue", "alpha"})
        properties.push_back({name, NumberType::kUint8});
    for (const FragmentArray& array : band.extra) {
        if (array.type != PixelType::kUint) continue;
        for (const std::string& channel : array.channels) {
            numbers_.push_back(channel);
            std::string name = channel;
            std::ranges::replace_if(
                name, [](unsigned char c) { return c <= ' ' || c == '.' || c >= 0x7f; }, '_');
            properties.push_back({name, NumberType::kUint32});
        }
    }
    writer_.emplace(path_, std::move(properties), std::vector<std::string>{options_.comment});
}

void FragmentPoints::write(LayeredImage&& band) {
    if (!writer_) open(band);
    std::vector<FragmentChannel> normal, numbers;
    for (const std::string& name : normal_)
        normal.push_back(findChannel(band, name));
    for (const std::string& name : numbers_)
        numbers.push_back(findChannel(band, name));

    const std::size_t size = writer_->pointSize();
    points_.resize(band.fragments() * size);
    const auto width = static_cast<std::size_t>(band.window.width());
    parallelFor(static_cast<std::size_t>(band.window.height()), [&](std::size_t row) {
        const double y = band.window.y0 + static_cast<int>(row) + 0.5;
        for (std::size_t column = 0; column < width; ++column) {
            const std::size_t pixel = row * width + column;
            const double x = band.window.x0 + static_cast<int>(column) + 0.5;
            for (std::size_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f) {
                std::byte* out = points_.data() + f * size;
                const glm::dvec3 position = worldPosition(view_, x, y, band.z[f]);
                for (int i = 0; i < 3; ++i) {
                    out = options_.double_positions
                              ? storeNumber(position[i], out)
                              : storeNumber(static_cast<float>(position[i]), out);
                }
                for (const FragmentChannel& component : normal)
                    out = storeNumber(component.value(f), out);
                out = storeNumber(displayColor(colorOf(band, f)), out);
                for (const FragmentChannel& number : numbers) {
                    std::memcpy(out, number.data(f), sizeof(std::uint32_t));
                    out += sizeof(std::uint32_t);
                }
            }
        }
    });
    writer_->append(points_);
}

}  // namespace

std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options) {
    return std::make_unique<FragmentPoints>(std::move(path), std::move(options));
}

}  // namespace peeler
