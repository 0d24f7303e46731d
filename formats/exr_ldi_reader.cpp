// SPDX-License-Identifier: Apache-2.0
// Parts decoded into planes, planes gathered into fragment lists.
#include "formats/exr_ldi_reader.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"

namespace peeler {
namespace {

constexpr std::size_t kColorChannels = 4, kDepthChannel = 4, kFirstExtra = 5;

}  // namespace

/// The decoded channels of a part in the window that is read, planar; empty where the part lacks
/// one.
struct ExrLdiReader::Layer {
    Window window;
    std::vector<std::vector<std::byte>> planes;

    /// A value of a channel; `size` is that of the channel's type.
    const std::byte* at(std::size_t channel, std::size_t column, int y, std::size_t size) const {
        const auto row = static_cast<std::size_t>(y - window.y0);
        const auto pixel = row * static_cast<std::size_t>(window.width()) + column;
        return planes[channel].data() + pixel * size;
    }
    const float* depths(int y) const {
        return reinterpret_cast<const float*>(at(kDepthChannel, 0, y, sizeof(float)));
    }
};

ExrLdiReader::ExrLdiReader(const std::string& path) : input_(path), info_(describe(input_)) {
    const std::string promised =
        info_.attributes().contains("peeler:layers") ? info_.attributes().at("peeler:layers") : "";
    if (info_.layers.empty() && promised != "0") {
        throw Error(ErrorKind::kInput, "it is not a layered depth image: no part is named layer_*",
                    path, "render with --as ldi");
    }
    if (!promised.empty() && promised != std::to_string(info_.layers.size())) {
        throw Error(
            ErrorKind::kInput,
            "it should have " + promised + " layers and has " + std::to_string(info_.layers.size()),
            path, "render it again");
    }
    findChannels();
}

ExrLdiReader::~ExrLdiReader() = default;

void ExrLdiReader::findChannels() {
    for (const char* name : {"R", "G", "B", "A"})
        channels_.push_back({name, info_.plan.color_type});
    channels_.push_back({"Z", PixelType::kFloat});
    for (const std::size_t layer : info_.layers) {
        const ExrInputPart& part = info_.parts[layer];
        if (part.type != "scanlineimage") {
            throw Error(ErrorKind::kInput,
                        "a layer is of type " + part.type + ", not scanlineimage",
                        input_.path() + ": " + part.name);
        }
        for (std::size_t c = 0; c < kFirstExtra; ++c) {
            const ExrInputChannel* channel = part.channel(channels_[c].name);
            if (channel && channel->type != PixelType::kUint) continue;
            throw Error(ErrorKind::kInput,
                        "a layer has no channel " + channels_[c].name + " of half or float",
                        input_.path() + ": " + part.name);
        }
    }
    if (info_.layers.empty()) return;
    std::string group;
    for (const ExrInputChannel& channel : info_.parts[info_.layers.front()].channels) {
        const auto named = [&](const ExrInputChannel& c) { return c.name == channel.name; };
        if (std::any_of(channels_.begin(), channels_.begin() + kFirstExtra, named)) continue;
        const std::string prefix = channel.name.substr(0, channel.name.rfind('.') + 1);
        if (extra_.empty() || prefix.empty() || prefix != group ||
            extra_.back().type != channel.type) {
            extra_.push_back({{}, channel.type, {}});
        }
        group = prefix;
        extra_.back().channels.push_back(channel.name);
        channels_.push_back(channel);
    }
}

std::vector<ExrLdiReader::Layer> ExrLdiReader::decode(
    const Window& window, std::span<const std::size_t> parts,
    std::span<const ExrInputChannel> channels) const {
    struct Job {
        std::size_t layer;
        int y;
    };
    std::vector<Layer> layers(parts.size());
    std::vector<std::vector<ExrTarget>> targets(parts.size());
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const ExrInputPart& part = info_.parts[parts[i]];
        Layer& layer = layers[i];
        layer.window = intersect(window, part.data_window);
        layer.planes.resize(channels.size());
        if (layer.window.empty()) continue;
        for (std::size_t c = 0; c < channels.size(); ++c) {
            if (!part.channel(channels[c].name)) continue;
            const std::size_t size = pixelTypeSize(channels[c].type);
            layer.planes[c].resize(layer.window.pixels() * size);
            targets[i].push_back({channels[c].name, channels[c].type, layer.planes[c].data(),
                                  static_cast<std::size_t>(layer.window.width()) * size});
        }
        const int rows = input_.rowsPerChunk(parts[i]);
        const int skipped = (layer.window.y0 - part.data_window.y0) / rows * rows;
        for (int y = part.data_window.y0 + skipped; y < layer.window.y1; y += rows) {
            jobs.push_back({i, y});
        }
    }
    parallelFor(jobs.size(), [&](std::size_t j) {
        const Job& job = jobs[j];
        input_.readChunk(parts[job.layer], job.y, layers[job.layer].window, targets[job.layer]);
    });
    return layers;
}

void ExrLdiReader::read(const Window& window, LayeredImage& out) {
    if (window.empty() || intersect(window, info_.plan.view.crop) != window) {
        throw Error(ErrorKind::kInternal, "the window is empty or outside the picture",
                    input_.path());
    }
    const std::vector<Layer> layers = decode(window, info_.layers, channels_);
    const auto width = static_cast<std::size_t>(window.width());
    const auto height = static_cast<std::size_t>(window.height());

    // Calls visit(x, layer, column in the layer) for each fragment of a row, front to back in each
    // pixel.
    const auto forEachFragment = [&](int y, auto&& visit) {
        for (const Layer& layer : layers) {
            if (layer.window.empty() || y < layer.window.y0 || y >= layer.window.y1) continue;
            const float* z = layer.depths(y);
            const auto left = static_cast<std::size_t>(layer.window.x0 - window.x0);
            const auto columns = static_cast<std::size_t>(layer.window.width());
            for (std::size_t x = 0; x < columns; ++x) {
                if (z[x] < std::numeric_limits<float>::infinity()) visit(left + x, layer, x);
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
    std::uint64_t total = 0;
    for (std::uint32_t& offset : out.offsets) {
        total += offset;
        if (total > std::numeric_limits<std::uint32_t>::max()) {
            throw Error(ErrorKind::kMemory, "over 2^32 fragments in one band", input_.path(),
                        "read fewer rows at once");
        }
        offset = static_cast<std::uint32_t>(total);
    }

    out.z.resize(total);
    out.color = {{"R", "G", "B", "A"}, info_.plan.color_type, std::move(out.color.data)};
    out.color.data.resize(total * out.color.stride());
    out.extra.resize(extra_.size());
    for (std::size_t i = 0; i < extra_.size(); ++i) {
        out.extra[i] = {extra_[i].channels, extra_[i].type, std::move(out.extra[i].data)};
        out.extra[i].data.assign(total * extra_[i].stride(), std::byte{0});
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
            for (std::size_t c = 0; c < kColorChannels; ++c) {
                store(out.color, fragment, c, layer, c, column);
            }
            std::size_t channel = kFirstExtra;
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
        throw Error(ErrorKind::kInput, "it has no part \"composite\"", input_.path(),
                    "flatten it, or render without --no-composite");
    }
    const auto part = static_cast<std::size_t>(info_.composite);
    const ExrInputPart& composite = info_.parts[part];
    if (window.empty() || intersect(window, composite.data_window) != window) {
        throw Error(ErrorKind::kInternal, "the window is empty or outside the part", input_.path());
    }
    std::vector<ExrInputChannel> channels;
    for (const char* name : {"R", "G", "B", "A", "Z"}) {
        if (!composite.channel(name) || composite.type != "scanlineimage") {
            throw Error(ErrorKind::kInput, std::string("the composite has no channel ") + name,
                        input_.path() + ": " + composite.name);
        }
        channels.push_back({name, PixelType::kFloat});
    }
    const Layer layer = std::move(decode(window, {&part, 1}, channels).front());
    out.window = window;
    out.rgba.resize(window.pixels());
    out.z.resize(window.pixels());
    for (std::size_t p = 0; p < out.z.size(); ++p) {
        for (std::size_t c = 0; c < kColorChannels; ++c) {
            std::memcpy(&out.rgba[p][c], layer.planes[c].data() + p * sizeof(float), sizeof(float));
        }
        std::memcpy(&out.z[p], layer.planes[kDepthChannel].data() + p * sizeof(float),
                    sizeof(float));
    }
}

int ExrLdiReader::rowsFor(std::uint64_t bytes) const {
    std::uint64_t pixel = 0;
    for (const auto& channel : channels_)
        pixel += pixelTypeSize(channel.type);
    // Planes and lists exist at once, hence twice; a layer's rows are as wide as its window.
    std::uint64_t row =
        static_cast<std::uint64_t>(info_.plan.view.crop.width()) * sizeof(std::uint32_t);
    for (const LayerPlan& layer : info_.plan.layers) {
        row += 2 * pixel * static_cast<std::uint64_t>(layer.data_window.width());
    }
    const auto rows = static_cast<std::uint64_t>(std::max(1, info_.plan.view.crop.height()));
    constexpr std::uint64_t kChunk = 16;
    return static_cast<int>(std::clamp(bytes / std::max<std::uint64_t>(1, row) / kChunk * kChunk,
                                       std::min(kChunk, rows), rows));
}

}  // namespace peeler
