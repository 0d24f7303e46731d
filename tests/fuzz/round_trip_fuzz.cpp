// SPDX-License-Identifier: Apache-2.0
// Fuzz target for round trips: writes a picture made from the input in every format that peeler
// also reads, and expects the reader to return the same bits.
#include <cmath>
#include <stdexcept>

#include "core/image/layers.h"
#include "formats/arrays/array_reader.h"
#include "formats/arrays/point_reader.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/synthetic_image.h"
#include "formats/layered/opened_picture.h"
#include "formats/writers.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

using test::SyntheticPicture;

void require(bool holds, const char* what) {
    if (!holds) throw std::logic_error(std::string("not the same: ") + what);
}

/// Takes channels and sorts them by name, as in a file. Channels that differ only after the last
/// dot share an array.
std::vector<FragmentArray> takeChannels(Taker& taker) {
    static constexpr std::array kNames = {
        "N.X",  "N.Y",   "N.Z",   "P.X",   "id.object", "id.instance", "id.material", "facing",
        "uv.U", "other", "a.b.c", "layer", "z",         "Y",           "V.X"};
    std::vector<ExrInputChannel> channels;
    for (const char* name : kNames)
        if (taker.below(4) == 3) channels.push_back({name, static_cast<PixelType>(taker.below(3))});
    std::ranges::sort(channels, {}, &ExrInputChannel::name);
    return fragmentArrays(channels);
}

/// Takes a depth of at least `least`: mostly `least` or the next float, which must stay different.
float takeDepth(Taker& taker, float least) {
    if (taker.flip()) return least;
    if (taker.flip()) return std::nextafter(least, 3e38F);
    const auto depth = std::abs(taker.take<float>());
    return depth < 1e38F ? std::max(least, depth) : least;
}

void appendBits(Taker& taker, FragmentArray& array) {
    for (std::size_t i = 0; i < array.stride(); ++i)
        array.data.push_back(taker.take<std::byte>());
}

void takeFragments(Taker& taker, LayeredImage& image) {
    const std::size_t most = 1 + taker.below(5);
    image.offsets = {0};
    for (std::uint64_t pixel = 0; pixel < image.window.pixels(); ++pixel) {
        const std::size_t count = taker.below(most + 1);
        float z = taker.flip() ? 0.0F : -1.0F;
        for (std::size_t k = 0; k < count; ++k) {
            image.z.push_back(z = takeDepth(taker, z));
            appendBits(taker, image.color);
            for (FragmentArray& array : image.extra)
                appendBits(taker, array);
        }
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
}

/// Takes a plan whose camera has numbers with many digits.
void takePlan(Taker& taker, SyntheticPicture& picture) {
    LayeredImage& image = picture.image;
    Plan& plan = picture.plan;
    View& view = plan.view;
    const auto side = [&] { return 1 + static_cast<int>(taker.below(12)); };
    const int left = static_cast<int>(taker.below(5)), top = static_cast<int>(taker.below(5));
    image.window = view.crop = {left, top, left + side(), top + side()};
    view.width = view.crop.x1 + static_cast<int>(taker.below(3));
    view.height = view.crop.y1 + static_cast<int>(taker.below(3));
    view.projection.perspective = taker.flip();
    view.projection.half_height = 0.1 + 1.0 / (1 + taker.take<std::uint16_t>());
    view.projection.half_width = view.projection.half_height * view.width / view.height;
    view.projection.near = 1e-3 * (1 + taker.take<std::uint16_t>()) / 7;
    if (!view.projection.perspective || taker.flip())
        view.projection.far = view.projection.near * 3 + taker.take<std::uint16_t>();
    view.camera_to_world[3] = {taker.take<std::int32_t>() / 7.0, taker.take<std::int16_t>() / 3.0,
                               0, 1};
    plan.color_type = taker.flip() ? PixelType::kHalf : PixelType::kFloat;
    plan.tinted = taker.below(4) == 3;
    image.color = {colorNames(plan.tinted), plan.color_type, {}};
    image.extra = takeChannels(taker);
    plan.channels = image.extra;
    for (const FragmentArray& array : image.extra)
        plan.channel_bytes += array.stride();
    takeFragments(taker, image);
    DepthComplexity complexity(view.crop);
    complexity.addBand(image);
    plan.layers = complexity.layers();
    plan.fragments_counted = plan.fragments_stored = image.fragments();
}

Provenance takeProvenance(Taker& taker) {
    const auto text = [&] {
        std::string result;
        for (std::size_t left = taker.below(6); left > 0; --left)
            result += static_cast<char>(' ' + taker.below(95));
        return result;
    };
    Provenance provenance;
    provenance.version = "1.2.3";
    provenance.scene = text();
    provenance.settings_hash = text();
    provenance.renderer = text();
    provenance.frame = taker.take<std::int32_t>();
    provenance.time = taker.take<std::int16_t>() / 24.0;
    return provenance;
}

void requireSame(const FragmentArray& a, const FragmentArray& b) {
    require(a.channels == b.channels, "names of channels");
    require(a.type == b.type, "types of channels");
    require(a.data == b.data, "values of channels");
}

void requireSame(const LayeredImage& a, const LayeredImage& b) {
    require(a.window == b.window, "window");
    require(a.offsets == b.offsets, "numbers of fragments");
    require(a.z == b.z, "Z");
    requireSame(a.color, b.color);
    require(a.extra.size() == b.extra.size(), "number of channels");
    for (std::size_t i = 0; i < a.extra.size(); ++i)
        requireSame(a.extra[i], b.extra[i]);
}

void requireSame(const View& a, const View& b) {
    require(a.camera_to_world == b.camera_to_world, "pose");
    require(a.projection.perspective == b.projection.perspective &&
                a.projection.half_width == b.projection.half_width &&
                a.projection.half_height == b.projection.half_height &&
                a.projection.near == b.projection.near && a.projection.far == b.projection.far,
            "projection");
    require(a.width == b.width && a.height == b.height && a.crop == b.crop, "picture");
}

void checkLayeredFile(const std::string& path, const SyntheticPicture& picture,
                      const Provenance& provenance) {
    const auto reader = openLayered(path);
    const ExrInfo& info = reader->info();
    requireSame(info.plan.view, picture.plan.view);
    require(info.plan.fragments_stored == picture.image.fragments(), "count in the header");
    require(info.plan.layers.size() == picture.plan.layers.size(), "number of layers");
    require(info.provenance.scene == provenance.scene &&
                info.provenance.settings_hash == provenance.settings_hash &&
                info.provenance.renderer == provenance.renderer &&
                info.provenance.frame == provenance.frame &&
                info.provenance.time == provenance.time,
            "provenance");
    LayeredImage image;
    reader->read(info.plan.view.crop, image);
    LayeredImage wanted = picture.image;
    // A picture without fragments has no layers, so it has no channels.
    if (wanted.fragments() == 0) wanted.extra = image.extra, wanted.color = image.color;
    requireSame(image, wanted);
}

/// Expects the .npy file of an array to end with these bytes.
void requireNumbers(const NpzArchive& archive, const char* name, std::span<const std::byte> bytes) {
    const NpzArchive::Member* const member = archive.find(name);
    require(member != nullptr, name);
    std::vector<std::uint8_t> storage;
    const auto file = std::as_bytes(archive.contents(*member, storage));
    require(file.size() >= bytes.size() && std::ranges::equal(file.last(bytes.size()), bytes),
            name);
}

void checkArrays(const std::string& path, const SyntheticPicture& picture) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const NpzArchive archive({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                             path);
    const LayeredImage& image = picture.image;
    const std::vector<std::int64_t> splits(image.offsets.begin(), image.offsets.end());
    requireNumbers(archive, "ray_splits", std::as_bytes(std::span(splits)));
    requireNumbers(archive, "z", std::as_bytes(std::span(image.z)));
    if (!image.tinted()) requireNumbers(archive, "rgba", image.color.data);
}

void takePicture(Input input) {
    Taker taker(input);
    SyntheticPicture picture;
    OutputOptions options;
    options.provenance = takeProvenance(taker);
    const std::vector<int> bands = {1 + static_cast<int>(taker.below(4)), 16};
    const auto choose = [&](const auto& rows) {
        return std::string(rows[taker.below(rows.size())].name);
    };
    options.layout = choose(exrLayouts());
    options.compression = choose(exrCompressions());
    options.no_composite = taker.flip();
    OutputOptions deep = options;
    deep.as = "deep";
    std::vector<ExrCompression> of_deep(exrCompressions().begin(), exrCompressions().end());
    std::erase_if(of_deep, [](const ExrCompression& row) { return !row.deep; });
    deep.compression = choose(of_deep);
    takePlan(taker, picture);

    const auto written = [&](const char* name, const OutputOptions& as) {
        const std::string path = (scratchFolder() / name).string();
        test::writePicture(*makeSink(path, as), picture, bands);
        return path;
    };
    checkLayeredFile(written("layers.exr", options), picture, options.provenance);
    checkLayeredFile(written("deep.exr", deep), picture, options.provenance);
    OutputOptions plain;
    plain.provenance = options.provenance;
    checkArrays(written("arrays.npz", plain), picture);
    const std::string points = written("points.ply", plain);
    if (picture.image.fragments() > 0)
        require(readPoints(points).size() == picture.image.fragments(), "number of points");
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(round_trip, peeler::fuzz::takePicture)
