// SPDX-License-Identifier: Apache-2.0
// Layered depth image reader: decodes parts into planes, and gathers fragment lists from the
// planes.
#include "formats/exr/exr_readers.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChromaticities.h>
#include <OpenEXR/ImfRgbaYca.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/image/composite.h"
#include "formats/exr/exr_attributes.h"
#include "formats/exr/exr_layout.h"

namespace peeler {
namespace {

// The order of the planes: R, G, B, A, Z, then AR, AG, AB if present.
constexpr std::size_t kColorChannels = 4, kAlphaChannel = 3, kDepthChannel = 4;

/// Returns the index of the plane that holds a colour component.
std::size_t planeOf(std::size_t component) {
    return component < kColorChannels ? component : component + 1;
}

/// Returns the channel names of the planes for colour and Z.
std::vector<std::string> planeNames(bool tinted) {
    std::vector<std::string> names = colorNames(tinted);
    names.insert(names.begin() + kDepthChannel, "Z");
    return names;
}

}  // namespace

/// The decoded channels of a layer inside the window being read, one plane per channel. If the
/// layer lacks a channel, its plane is empty.
struct ExrLdiReader::Layer {
    Window window;
    std::vector<std::vector<std::byte>> planes;

    /// Returns the address of a channel's value. `size` is the size of the value's type, in bytes.
    const std::byte* at(std::size_t channel, std::size_t column, int y, std::size_t size) const {
        const auto row = static_cast<std::size_t>(y - window.y0);
        const auto pixel = row * static_cast<std::size_t>(window.width()) + column;
        return planes[channel].data() + pixel * size;
    }
    template <class T>
    std::span<T> as(std::size_t channel) {
        return {reinterpret_cast<T*>(planes[channel].data()), planes[channel].size() / sizeof(T)};
    }
    const float* depths(int y) const {
        return reinterpret_cast<const float*>(at(kDepthChannel, 0, y, sizeof(float)));
    }
};

ExrLdiReader::ExrLdiReader(OpenedExr opened, const std::optional<ExrPicture>& picture,
                           bool composite)
    : opened_(std::move(opened)), pixels_(composite) {
    const std::string promised = info_.parts.front().attribute("peeler:layers");
    const bool lone_layer = info_.parts.front().attribute("peeler:layout") == kPerFileLayout &&
                            info_.layers.size() == 1 && info_.composite < 0;
    if (pixels_) {
        takeComposite();
    } else if (picture) {
        takePicture(*picture);
    } else if (info_.layers.empty() && promised != "0") {
        throw Error(ErrorKind::kInput,
                    "the file is not a layered depth image: no part is named layer_*",
                    input_.path(), "render with " + Parameter::kAs + " ldi");
    } else if (!promised.empty() && promised != std::to_string(info_.layers.size()) &&
               !lone_layer) {
        throw Error(ErrorKind::kInput,
                    "the file should have " + promised + " layers but has " +
                        std::to_string(info_.layers.size()),
                    input_.path(), "render it again");
    }
    for (std::size_t i = 0; i < info_.layers.size(); ++i)
        sources_.push_back({info_.layers[i], info_.prefixes[i]});
    findChannels();
    checkLayers();
    place();
}

/// Warns about parts that are not read. Sets the windows of the picture and of its layers.
void ExrLdiReader::place() {
    std::vector<std::size_t> read = info_.layers;
    if (info_.composite >= 0) read.push_back(static_cast<std::size_t>(info_.composite));
    warnOfUnread(opened_, read);
    readCarried(opened_, read.empty() ? 0 : read.front());
    Window all;
    for (const std::size_t part : read)
        all = unite(all, info_.parts[part].data_window);
    if (!all.empty()) placePixels(info_.plan.view, all, opened_.options.pixels_only, input_.path());
    for (LayerPlan& layer : info_.plan.layers) {
        layer.data_window = intersect(layer.data_window, info_.plan.view.crop);
        if (layer.data_window.empty()) layer.data_window = {};
    }
}

ExrLdiReader::~ExrLdiReader() = default;

/// Reads the composite as the only layer. The plan keeps the number of layers that were composited.
void ExrLdiReader::takeComposite() {
    if (info_.composite < 0 || !info_.layers.empty()) {
        throw Error(ErrorKind::kInput, "the file is not a composite", input_.path(),
                    "composites have one part, named composite");
    }
    flat_ = true;
    info_.plan.layers.resize(info_.layersOfComposite());
    info_.layers = {static_cast<std::size_t>(info_.composite)};
    info_.prefixes = {""};
}

void ExrLdiReader::takePicture(const ExrPicture& picture) {
    const ExrInputPart& part = info_.parts[picture.part];
    flat_ = true;
    colors_ = picture.colors;
    info_.layers = {picture.part};
    info_.prefixes = {""};
    info_.composite = -1;
    info_.plan.layers = {{part.data_window, 0}};
    info_.plan.tinted = colors_.tinted();
    info_.plan.color_type = PixelType::kHalf;
    // Until completeColors() converts the pixels, R holds the luminance, and G and B hold RY and
    // BY.
    if (!colors_.luminance.empty())
        colors_.rgb = {colors_.luminance, colors_.chroma[0], colors_.chroma[1]};
    for (const std::string& name : colorNames(true)) {
        const ExrInputChannel* channel = part.channel(colors_.named(name));
        if (channel && channel->type != PixelType::kHalf) info_.plan.color_type = PixelType::kFloat;
    }
}

void ExrLdiReader::checkLayers() const {
    for (const Source& source : sources_) {
        const ExrInputPart& part = info_.parts[source.part];
        if (part.deep())
            throw Error(ErrorKind::kInput,
                        "a part with the name of a layer is deep (" + part.type + ")",
                        input_.where(source.part), "rename the part");
        for (std::size_t c = 0; c < first_extra_; ++c) {
            const ExrInputChannel* channel = part.channel(storedName(source, channels_, c));
            if (channel ? channel->type != PixelType::kUint : flat_) continue;
            throw Error(ErrorKind::kInput,
                        "a layer has no half or float channel " + source.prefix + channels_[c].name,
                        input_.where(source.part),
                        "read a part by itself with " + Parameter::kPart);
        }
    }
}

void ExrLdiReader::findChannels() {
    for (const std::string& name : planeNames(info_.plan.tinted))
        channels_.push_back({name, info_.plan.color_type});
    channels_[kDepthChannel].type = PixelType::kFloat;
    first_extra_ = channels_.size();
    if (sources_.empty()) return;
    const Source& first = sources_.front();
    const bool foreign = flat_ && !pixels_;
    if (foreign) {
        for (const ExrInputChannel& channel : channels_)
            stored_.push_back(colors_.named(channel.name));
    }
    std::vector<ExrInputChannel> others;
    for (const ExrInputChannel& channel : info_.parts[first.part].channels) {
        if (!channel.name.starts_with(first.prefix)) continue;
        const ExrInputChannel bare{channel.name.substr(first.prefix.size()), channel.type};
        const auto named = [&](const ExrInputChannel& c) { return c.name == bare.name; };
        const bool taken = std::ranges::find(stored_, bare.name) != stored_.end();
        if (std::ranges::none_of(channels_, named) && !taken) others.push_back(bare);
    }
    if (foreign) {
        for (const ExrInputChannel& channel : others)
            stored_.push_back(channel.name);
    }
    extra_ = fragmentArrays(others);
    channels_.insert(channels_.end(), others.begin(), others.end());
}

/// Returns a channel's name in the layer's part. For a flat picture, returns "" if the channel is
/// missing.
std::string ExrLdiReader::storedName(const Source& source,
                                     std::span<const ExrInputChannel> channels,
                                     std::size_t c) const {
    return stored_.empty() ? source.prefix + channels[c].name : stored_[c];
}

std::vector<ExrLdiReader::Layer> ExrLdiReader::decode(
    const Window& window, std::span<const Source> sources,
    std::span<const ExrInputChannel> channels) const {
    struct Job {
        std::size_t part;
        int y;
    };
    std::vector<Layer> layers(sources.size());
    // Decode all layers of a part together, so that each chunk is unpacked once.
    std::map<std::size_t, std::vector<ExrTarget>> targets;
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const std::size_t index = sources[i].part;
        const ExrInputPart& part = info_.parts[index];
        Layer& layer = layers[i];
        layer.window = intersect(window, part.data_window);
        layer.planes.resize(channels.size());
        if (layer.window.empty()) continue;
        const auto [wanted, first] = targets.try_emplace(index);
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const std::string name = storedName(sources[i], channels, c);
            if (!part.channel(name)) continue;
            const std::size_t size = pixelTypeSize(channels[c].type);
            layer.planes[c].resize(layer.window.pixels() * size);
            wanted->second.push_back({name, channels[c].type, layer.planes[c].data(),
                                      static_cast<std::size_t>(layer.window.width()) * size});
        }
        if (!first) continue;
        const int rows = input_.rowsPerChunk(index);
        const int skipped = (layer.window.y0 - part.data_window.y0) / rows * rows;
        for (int y = part.data_window.y0 + skipped; y < layer.window.y1; y += rows)
            jobs.push_back({index, y});
    }
    parallelFor(jobs.size(), [&](std::size_t j) {
        const Job& job = jobs[j];
        input_.readChunk(job.part, job.y, intersect(window, info_.parts[job.part].data_window),
                         targets.at(job.part));
    });
    return layers;
}

/// Sets alpha to the mean of AR, AG and AB, or to 1 if these channels are missing.
template <class T>
void ExrLdiReader::completeAlpha(Layer& layer) const {
    const std::span<T> alpha = layer.as<T>(kAlphaChannel);
    if (!colors_.tinted()) {
        std::ranges::fill(alpha, T(1.0F));
        return;
    }
    const std::span<T> r = layer.as<T>(planeOf(4)), g = layer.as<T>(planeOf(5)),
                       b = layer.as<T>(planeOf(6));
    for (std::size_t p = 0; p < alpha.size(); ++p)
        alpha[p] = T(meanOpacity<float>(r[p], g[p], b[p]));
}

/// Computes R, G, B from Y, or from Y, RY = (R − Y) / Y and BY = (B − Y) / Y ("Luminance/Chroma
/// Images", openexr.com/en/latest/TechnicalIntroduction.html).
template <class T>
void ExrLdiReader::completeColors(Layer& layer) const {
    if (colors_.alpha.empty()) completeAlpha<T>(layer);
    if (colors_.luminance.empty()) return;
    const std::span<T> r = layer.as<T>(0), g = layer.as<T>(1), b = layer.as<T>(2);
    if (colors_.chroma[0].empty()) {
        std::ranges::copy(r, g.begin());
        std::ranges::copy(r, b.begin());
        return;
    }
    Imf::Chromaticities primaries;
    if (const auto& own = info_.parts[info_.layers.front()].chromaticities)
        primaries = {{(*own)[0], (*own)[1]},
                     {(*own)[2], (*own)[3]},
                     {(*own)[4], (*own)[5]},
                     {(*own)[6], (*own)[7]}};
    const Imath::V3f weight = Imf::RgbaYca::computeYw(primaries);
    for (std::size_t p = 0; p < r.size(); ++p) {
        const float y = r[p], red = (g[p] + 1) * y, blue = (b[p] + 1) * y;
        r[p] = red;
        g[p] = (y - red * weight.x - blue * weight.z) / weight.y;
        b[p] = blue;
    }
}

/// Fills in the channels that are missing in a flat picture.
void ExrLdiReader::completePicture(Layer& layer) {
    for (std::size_t c = 0; c < first_extra_; ++c)
        layer.planes[c].resize(layer.window.pixels() * pixelTypeSize(channels_[c].type));
    if (info_.plan.color_type == PixelType::kHalf)
        completeColors<half>(layer);
    else
        completeColors<float>(layer);
    completeDepth(layer);
}

/// Makes Z finite. Then sets Z to +inf in pixels where R, G, B and A are all 0, if Z is missing or
/// the largest float.
void ExrLdiReader::completeDepth(Layer& layer) {
    constexpr float kNothing = std::numeric_limits<float>::infinity();
    const std::size_t size = pixelTypeSize(info_.plan.color_type);
    const std::span<float> depths = layer.as<float>(kDepthChannel);
    makeDepthsFinite(depths, opened_.warnings);
    for (std::size_t p = 0; p < depths.size(); ++p) {
        bool empty = true;
        for (std::size_t byte = p * size; byte < (p + 1) * size; ++byte) {
            for (std::size_t c = 0; c < kColorChannels; ++c)
                empty = empty && layer.planes[c][byte] == std::byte{0};
        }
        const bool behind_all = depths[p] == std::numeric_limits<float>::max();
        if (empty && (colors_.depth.empty() || behind_all)) depths[p] = kNothing;
    }
}

void ExrLdiReader::read(const Window& window, LayeredImage& out) {
    if (window.empty() || intersect(window, info_.plan.view.crop) != window) {
        throw Error(ErrorKind::kInternal, "the window is empty or outside the picture",
                    input_.path());
    }
    std::vector<Layer> layers = decode(window, sources_, channels_);
    if (!stored_.empty()) completePicture(layers.front());
    const auto width = static_cast<std::size_t>(window.width());
    const auto height = static_cast<std::size_t>(window.height());

    // Calls visit(x, layer, column in the layer) for each fragment of a row, pixel by pixel, front
    // to back.
    const auto forEachFragment = [&](int y, auto&& visit) {
        for (const Layer& layer : layers) {
            if (layer.window.empty() || y < layer.window.y0 || y >= layer.window.y1) continue;
            const float* z = layer.depths(y);
            const auto left = static_cast<std::size_t>(layer.window.x0 - window.x0);
            const auto columns = static_cast<std::size_t>(layer.window.width());
            for (std::size_t x = 0; x < columns; ++x) {
                if (pixels_ || z[x] < std::numeric_limits<float>::infinity())
                    visit(left + x, layer, x);
            }
        }
    };

    out.window = window;
    out.offsets.assign(width * height + 1, 0);
    parallelFor(height, [&](std::size_t row) {
        std::uint32_t* counts = out.offsets.data() + 1 + row * width;
        forEachFragment(window.y0 + static_cast<int>(row),
                        [&](std::size_t x, const Layer&, std::size_t) { ++counts[x]; });
    });
    countsToOffsets(out.offsets, input_.path());
    const std::size_t total = out.offsets.back();

    resizeAnew(out.z, total);
    out.color = {colorNames(info_.plan.tinted), info_.plan.color_type, std::move(out.color.data)};
    const std::size_t components = out.color.components();
    resizeAnew(out.color.data, total * out.color.stride());
    out.extra.resize(extra_.size());
    for (std::size_t i = 0; i < extra_.size(); ++i) {
        out.extra[i] = {extra_[i].channels, extra_[i].type, std::move(out.extra[i].data)};
        out.extra[i].data.clear();
        resizeAnew(out.extra[i].data, total * extra_[i].stride());
    }
    parallelFor(height, [&](std::size_t row) {
        const int y = window.y0 + static_cast<int>(row);
        const std::uint32_t* offsets = out.offsets.data() + row * width;
        std::vector<std::uint32_t> next(offsets, offsets + width);
        const auto store = [y](FragmentArray& array, std::size_t fragment, std::size_t component,
                               const Layer& layer, std::size_t channel, std::size_t column) {
            if (layer.planes[channel].empty()) return;  // the layer lacks this channel
            const std::size_t size = pixelTypeSize(array.type);
            std::memcpy(array.data.data() + fragment * array.stride() + component * size,
                        layer.at(channel, column, y, size), size);
        };
        forEachFragment(y, [&](std::size_t x, const Layer& layer, std::size_t column) {
            const std::size_t fragment = next[x]++;
            out.z[fragment] = layer.depths(y)[column];
            for (std::size_t c = 0; c < components; ++c) {
                store(out.color, fragment, c, layer, planeOf(c), column);
            }
            std::size_t channel = first_extra_;
            for (FragmentArray& array : out.extra) {
                for (std::size_t c = 0; c < array.components(); ++c, ++channel) {
                    store(array, fragment, c, layer, channel, column);
                }
            }
        });
    });
}

void ExrLdiReader::readComposite(const Window& window, CompositeImage& out) {
    if (info_.composite < 0) {
        throw Error(ErrorKind::kInput, "the file has no part \"composite\"", input_.path(),
                    "flatten it, or render without " + Parameter::kNoComposite);
    }
    const auto part = static_cast<std::size_t>(info_.composite);
    const ExrInputPart& composite = info_.parts[part];
    if (window.empty() || intersect(window, composite.data_window) != window) {
        throw Error(ErrorKind::kInternal, "the window is empty or outside the part", input_.path());
    }
    std::vector<ExrInputChannel> channels;
    const bool tinted = hasTint(composite, "");
    for (const std::string& name : planeNames(tinted)) {
        if (!composite.channel(name) || composite.type != "scanlineimage") {
            throw Error(ErrorKind::kInput, "the composite has no channel " + name,
                        input_.where(part));
        }
        channels.push_back({name, PixelType::kFloat});
    }
    const Source source{part, ""};
    const Layer layer = std::move(decode(window, {&source, 1}, channels).front());
    out.window = window;
    out.resizeColors(tinted);
    out.z.resize(window.pixels());
    for (std::size_t p = 0; p < out.z.size(); ++p) {
        TintedColor color{};
        for (std::size_t c = 0; c < colorComponents(tinted); ++c) {
            std::memcpy(&color[c], layer.planes[planeOf(c)].data() + p * sizeof(float),
                        sizeof(float));
        }
        out.setColor(p, color);
        std::memcpy(&out.z[p], layer.planes[kDepthChannel].data() + p * sizeof(float),
                    sizeof(float));
    }
}

/// Returns the bytes per pixel in the planes of a layer.
std::uint64_t ExrLdiReader::pixelBytes() const {
    std::uint64_t pixel = 0;
    for (const auto& channel : channels_)
        pixel += pixelTypeSize(channel.type);
    return pixel;
}

BandRead ExrLdiReader::mostOf(int rows) const {
    const Window& crop = info_.plan.view.crop;
    BandRead most;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        const Window band{crop.x0, y, crop.x1, std::min(y + rows, crop.y1)};
        std::uint64_t pixels = 0;
        for (const Source& source : sources_)
            pixels += intersect(band, info_.parts[source.part].data_window).pixels();
        most.fragments = std::max<std::uint64_t>(most.fragments, pixels);
    }
    most.bytes = most.fragments * pixelBytes();
    const std::uint64_t stored = info_.plan.fragments_stored;
    if (info_.is_peeler && stored != 0) most.fragments = std::min(most.fragments, stored);
    std::map<std::size_t, std::uint64_t> layers;  // number of layers in each part
    std::uint64_t chunk = 0;
    for (const Source& source : sources_) {
        const auto width = static_cast<std::uint64_t>(info_.parts[source.part].data_window.width());
        const auto height = static_cast<std::uint64_t>(input_.rowsPerChunk(source.part));
        chunk = std::max(chunk, width * height * ++layers[source.part] * pixelBytes());
    }
    // Each thread holds its chunk four times: packed, unpacked, reordered and in planes.
    most.bytes += 4 * chunk * static_cast<std::uint64_t>(threadCount());
    return most;
}

int ExrLdiReader::rowsFor(std::uint64_t bytes) const {
    const std::uint64_t pixel = pixelBytes();
    // The factor 2 is for planes and lists, which are in memory together.
    std::uint64_t row =
        static_cast<std::uint64_t>(info_.plan.view.crop.width()) * sizeof(std::uint32_t);
    for (const Source& source : sources_)
        row += 2 * pixel * static_cast<std::uint64_t>(info_.parts[source.part].data_window.width());
    const auto rows = static_cast<std::uint64_t>(std::max(1, info_.plan.view.crop.height()));
    constexpr std::uint64_t kChunk = 16;
    return static_cast<int>(std::clamp(bytes / std::max<std::uint64_t>(1, row) / kChunk * kChunk,
                                       std::min(kChunk, rows), rows));
}

}  // namespace peeler
