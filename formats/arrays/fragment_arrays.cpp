// SPDX-License-Identifier: Apache-2.0
// Writes fragments as a .npz.
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/image/layered_image.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"

namespace peeler {
namespace {

NumberType numberTypeOf(PixelType type) {
    constexpr NumberType kTypes[] = {NumberType::kHalf, NumberType::kFloat, NumberType::kUint32};
    return kTypes[static_cast<std::size_t>(type)];
}

/// The key of a channel, which is no path in the archive, and not taken yet.
std::string arrayKey(std::string channel, std::set<std::string>& taken) {
    std::ranges::replace_if(
        channel, [](unsigned char c) { return c < ' ' || c == '/' || c == '\\' || c >= 0x7f; },
        '_');
    while (!taken.insert(channel).second)
        channel += '_';
    return channel;
}

class FragmentArrays final : public Sink {
  public:
    FragmentArrays(std::string path, bool camera_known)
        : path_(std::move(path)), camera_known_(camera_known) {}

    void begin(const Plan& plan) override { plan_ = plan; }
    void write(LayeredImage&& band) override;
    void finish() override { writer_->finish(); }

  private:
    /// The arrays of every file, in this order; then one for each channel.
    enum Array : std::size_t {
        kSplits,
        kZ,
        kColor,
        kWindow,
        kSize,
        kPerspective,
        kCameraToWorld,
        kHalfWidth,
        kHalfHeight,
        kNear,
        kFar,
        kFirstChannel  ///< or, where opacity is coloured, that, and the channels after it
    };

    void open(const LayeredImage& band);
    void writeCamera();
    void writeColors(const LayeredImage& band);

    std::string path_;
    bool camera_known_;
    Plan plan_;
    std::vector<std::string> channels_;  ///< of `extra`, as in the file
    std::optional<NpzWriter> writer_;    ///< from the first band on
    std::int64_t fragments_ = 0;         ///< so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

void FragmentArrays::open(const LayeredImage& band) {
    const std::uint64_t n = plan_.fragments_stored;
    std::vector<NpzArray> arrays = {
        {"ray_splits", NumberType::kInt64, {plan_.view.crop.pixels() + 1}},
        {"z", NumberType::kFloat, {n}},
        {"rgba", numberTypeOf(band.color.type), {n, 4}},
        {"window", NumberType::kInt64, {4}},
        {"size", NumberType::kInt64, {2}},
        {"perspective", NumberType::kUint8, {}},
        {"camera_to_world", NumberType::kDouble, {4, 4}},
        {"half_width", NumberType::kDouble, {}},
        {"half_height", NumberType::kDouble, {}},
        {"near", NumberType::kDouble, {}},
        {"far", NumberType::kDouble, {}},
    };
    if (plan_.tinted) arrays.push_back({"opacity", numberTypeOf(band.color.type), {n, 3}});
    std::set<std::string> taken;
    for (const NpzArray& array : arrays)
        taken.insert(array.name);
    for (const FragmentArray& array : band.extra) {
        for (const std::string& channel : array.channels) {
            channels_.push_back(channel);
            arrays.push_back({arrayKey(channel, taken), numberTypeOf(array.type), {n}});
        }
    }
    writer_.emplace(path_, std::move(arrays));
    writeCamera();
    writer_->append(kSplits, std::as_bytes(std::span(&fragments_, 1)));
}

void FragmentArrays::writeCamera() {
    const View& view = plan_.view;
    const auto number = [&](Array array, auto value) {
        writer_->append(array, std::as_bytes(std::span(&value, 1)));
    };
    number(kWindow, std::array<std::int64_t, 4>{view.crop.x0, view.crop.y0, view.crop.width(),
                                                view.crop.height()});
    number(kSize, std::array<std::int64_t, 2>{view.width, view.height});
    number(kPerspective, static_cast<std::uint8_t>(view.projection.perspective ? 1 : 0));
    const auto camera_number = [&](Array array, double value) {
        number(array, camera_known_ ? value : std::numeric_limits<double>::quiet_NaN());
    };
    camera_number(kHalfWidth, view.projection.half_width);
    camera_number(kHalfHeight, view.projection.half_height);
    camera_number(kNear, view.projection.near);
    camera_number(kFar, view.projection.far);
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column)
            camera_number(kCameraToWorld, view.camera_to_world[column][row]);
    }
}

void FragmentArrays::writeColors(const LayeredImage& band) {
    if (!plan_.tinted) return writer_->append(kColor, band.color.data);
    const std::size_t number = pixelTypeSize(band.color.type), stride = band.color.stride();
    const auto components = [&](std::size_t first, std::size_t count) {
        values_.resize(band.fragments() * count * number);
        for (std::size_t f = 0; f < band.fragments(); ++f) {
            std::memcpy(values_.data() + f * count * number,
                        band.color.data.data() + f * stride + first * number, count * number);
        }
        return std::span<const std::byte>(values_);
    };
    writer_->append(kColor, components(0, kPlainComponents));
    writer_->append(kFirstChannel,
                    components(kPlainComponents, kTintedComponents - kPlainComponents));
}

void FragmentArrays::write(LayeredImage&& band) {
    if (!writer_) open(band);
    splits_.clear();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        splits_.push_back(fragments_ + band.offsets[p]);
    fragments_ += static_cast<std::int64_t>(band.fragments());
    writer_->append(kSplits, std::as_bytes(std::span(splits_)));
    writer_->append(kZ, std::as_bytes(std::span(band.z)));
    writeColors(band);
    const std::size_t first_channel = kFirstChannel + (plan_.tinted ? 1U : 0U);
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        const FragmentChannel channel = findChannel(band, channels_[i]);
        const std::size_t size = pixelTypeSize(channel.type());
        values_.resize(band.fragments() * size);
        for (std::size_t f = 0; f < band.fragments(); ++f)
            std::memcpy(values_.data() + f * size, channel.data(f), size);
        writer_->append(first_channel + i, values_);
    }
}

}  // namespace

std::unique_ptr<Sink> makeFragmentArrays(std::string path, bool camera_known) {
    return std::make_unique<FragmentArrays>(std::move(path), camera_known);
}

}  // namespace peeler
