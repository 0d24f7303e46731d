// SPDX-License-Identifier: Apache-2.0
#include "cmd/extract/layer_files.h"

#include <algorithm>
#include <set>
#include <string>

#include <peeler/error.h>
#include "cmd/options/output_checks.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/file_name.h"
#include "formats/image/image_library.h"
#include "formats/image/image_writer.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kOpenAtOnce = 32;
// Bytes in the buffer of an AtomicFile.
constexpr std::uint64_t kFileBuffer = std::uint64_t{1} << 20;

}  // namespace

LayerFiles::LayerFiles(const OutputRequest& output, const Provenance& provenance,
                       std::vector<std::size_t> layers, const std::filesystem::path& input)
    : output_(output), provenance_(provenance), layers_(std::move(layers)) {
    output_.options.as =
        needCounts(output) ? findOutputFormat(output.path.string(), "").kind : "composite";
    std::set<std::filesystem::path> names;
    for (const std::size_t layer : layers_) {
        OutputRequest one = output_;
        one.path = path(layer);
        if (!names.insert(one.path).second) {
            throw Error(ErrorKind::kUsage, "all layers would have the same file name",
                        "--output " + output.path.string(),
                        "put #### or %04d into the file's name for the layer's number, or choose "
                        "one layer with --layer");
        }
        checkOutput(one, {input});
    }
    output_.options.no_composite = true;
}

bool LayerFiles::needCounts(const OutputRequest& output) {
    return findOutputFormat(output.path.string(), "").holdsFragments();
}

std::filesystem::path LayerFiles::path(std::size_t layer) const {
    const std::string pattern = output_.path.string();
    return hasFrameToken(pattern) ? framePath(pattern, static_cast<int>(layer)) : pattern;
}

Plan LayerFiles::planOf(const Plan& whole, std::size_t layer) {
    Plan plan = whole;
    plan.layers = {whole.layers[layer]};
    plan.fragments_stored = whole.layers[layer].pixels;
    return plan;
}

SizeForecast LayerFiles::forecast(const Plan& whole, std::size_t layer) const {
    return forecastPicture(path(layer).string(), planOf(whole, layer), output_.from(provenance_));
}

SinkMemory LayerFiles::memory(const Plan& whole, int rows, std::uint64_t fragment_bytes) const {
    const bool pictures = !needCounts(output_);
    const OutputOptions options = output_.from(provenance_);
    const ImageFormat* const format = findImageFormat(output_.path.string());
    std::uint64_t shared = 0;
    if (pictures && format) {
        const std::uint64_t picture =
            whole.view.crop.pixels() * 4 * static_cast<std::uint64_t>(format->bits / 8);
        shared = sharedEncoderBytes(std::string(format->name), picture);
    }
    const std::uint64_t pixel = fragment_bytes + sizeof(std::uint32_t);
    SinkMemory most;
    for (std::size_t first = 0; first < layers_.size(); first += kOpenAtOnce) {
        SinkMemory open;
        const std::size_t end = std::min(first + kOpenAtOnce, layers_.size());
        for (std::size_t i = first; i < end; ++i) {
            Plan plan = planOf(whole, layers_[i]);
            // At most one band's rows are compressed at a time, and empty pixels compress to almost
            // nothing. So assume that all fragments lie in full rows.
            Window& window = plan.layers.front().data_window;
            // 0 = the pixels are not counted yet.
            const std::uint64_t pixels = plan.layers.front().pixels;
            const auto width = static_cast<std::uint64_t>(window.width());
            const int full = pixels > 0 ? static_cast<int>(pixels / width) : rows;
            window.y1 = std::min(window.y1, window.y0 + std::min(rows, full) + kExrRowsPerChunk);
            const SinkMemory one = makeSink(path(layers_[i]).string(), options)->memory(plan);
            const std::uint64_t across =
                pictures ? static_cast<std::uint64_t>(plan.view.crop.width()) : width;
            const std::uint64_t kept = static_cast<std::uint64_t>(one.rows) * across * pixel;
            const std::uint64_t buffered = pictures     ? 0
                                           : pixels > 0 ? std::min(pixels * pixel, kFileBuffer)
                                                        : kFileBuffer;
            open.bytes += kept + one.bytes - std::min(one.bytes, shared) + buffered;
            open.pixel_bytes += one.pixel_bytes;
        }
        most.bytes = std::max(most.bytes, open.bytes + shared);
        most.pixel_bytes = std::max(most.pixel_bytes, open.pixel_bytes);
    }
    // Memory for the layer being written, and for the growing list of its fragments' indices.
    most.pixel_bytes += pixel + 3 * sizeof(std::uint32_t);
    return most;
}

void LayerFiles::begin(const Plan& whole) {
    const OutputOptions options = output_.from(provenance_);
    for (; left() && open_.size() < kOpenAtOnce; ++next_) {
        const std::size_t layer = layers_[next_];
        open_.emplace_back(layer, makeSink(path(layer).string(), options))
            .second->begin(planOf(whole, layer));
    }
}

void LayerFiles::write(const LayeredImage& band) {
    for (auto& [layer, sink] : open_) {
        singleLayer(band, static_cast<std::uint32_t>(layer), layer_);
        sink->write(std::move(layer_));
    }
}

void LayerFiles::finish(StageTimes& times) {
    for (auto& [layer, sink] : open_) {
        sink->finish();
        add(times, sink->times());
    }
    open_.clear();
}

}  // namespace peeler::cmd
