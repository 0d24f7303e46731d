// SPDX-License-Identifier: Apache-2.0
#include "cmd/extract/layer_files.h"

#include <set>

#include "core/base/error.h"
#include "core/image/layers.h"
#include "formats/file/file_name.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kOpenAtOnce = 32;

}  // namespace

LayerFiles::LayerFiles(const OutputRequest& output, const Provenance& provenance,
                       std::vector<std::size_t> layers, const std::filesystem::path& input)
    : output_(output), provenance_(provenance), layers_(std::move(layers)) {
    output_.options.as = needCounts(output) ? "ldi" : "composite";
    std::set<std::filesystem::path> names;
    for (const std::size_t layer : layers_) {
        OutputRequest one = output_;
        one.path = path(layer);
        if (!names.insert(one.path).second) {
            throw Error(ErrorKind::kUsage, "the layers would have the same name",
                        "--output " + output.path.string(),
                        "put #### or %04d into the file's name, where the layer's number goes, or "
                        "choose one with --layer");
        }
        checkOutput(one, {input});
    }
    output_.options.no_composite = true;
}

bool LayerFiles::needCounts(const OutputRequest& output) {
    return findOutputFormat(output.path.string(), "").holds(OutputContent::kLayers);
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
