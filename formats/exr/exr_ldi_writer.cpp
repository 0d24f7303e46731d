// SPDX-License-Identifier: Apache-2.0
// Layered depth image and composite writers: the parts of their files.
#include "formats/exr/exr_writers.h"

#include <algorithm>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_files.h"

namespace peeler {

ExrPartsSink::ExrPartsSink(std::string path, OutputOptions options)
    : path_(std::move(path)), options_(std::move(options)) {}

ExrPartsSink::~ExrPartsSink() = default;

void ExrPartsSink::write(LayeredImage&& band) {
    writer_->write(band);
}

void ExrPartsSink::finish() {
    writer_->finish();
    times_ = writer_->times();
    writer_.reset();
}

SinkMemory ExrPartsSink::memory(const Plan& plan) const {
    return ExrBandWriter::memory(partsOf(plan), plan, options_);
}

ExrLdiWriter::ExrLdiWriter(std::string path, OutputOptions options)
    : ExrPartsSink(std::move(path), std::move(options)) {
    exrCompressionOf(options_.compression, false);
    // The part `composite` always shows the stored layers, without a background.
    options_.composited = false;
    options_.background = {};
}

void ExrLdiWriter::begin(const Plan& plan) {
    const ExrLayout& layout = findExrLayout(options_.layout);
    options_.layout = layout.name;
    std::vector<std::string> paths = {path_};
    for (std::size_t i = 0; layout.one_file_a_layer && i < plan.layers.size(); ++i)
        paths.push_back(exrLayerFile(path_, i));
    fragments_planned_ = plan.fragments_stored;
    writer_ = std::make_unique<ExrBandWriter>(paths, partsOf(plan), plan, options_);
}

std::vector<ExrPart> ExrLdiWriter::partsOf(const Plan& plan) const {
    const ExrLayout& layout = findExrLayout(options_.layout);
    std::vector<ExrPart> parts;
    if (!options_.no_composite || plan.layers.empty() || layout.one_file_a_layer)
        parts.push_back({.name = std::string(layout.composite_part), .window = plan.view.crop});
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        const Window& window = plan.layers[i].data_window;
        if (window.empty() || intersect(window, plan.view.crop) != window) {
            throw Error(ErrorKind::kInternal, "a layer's window is empty or outside the crop",
                        layerName(i));
        }
        const int layer = static_cast<int>(i);
        if (layout.one_part && !parts.empty()) {
            parts.front().layers.push_back(layer);
            parts.front().window = unite(parts.front().window, window);
            continue;
        }
        parts.push_back({.name = layerName(i), .window = window, .layers = {layer}});
        if (layout.one_file_a_layer) {
            parts.back().file = i + 1;
            parts.back().fragments = plan.layers[i].pixels;
        }
    }
    for (ExrPart& part : parts) {
        part.prefixed = layout.prefixed;
        if (layout.one_part && part.layers.front() != ExrPart::kComposite) part.name = "layers";
    }
    return parts;
}

void ExrLdiWriter::finish() {
    if (writer_->fragmentsSeen() != fragments_planned_ ||
        writer_->fragmentsWritten() != fragments_planned_) {
        throw Error(ErrorKind::kInternal,
                    "the plan has " + std::to_string(fragments_planned_) +
                        " fragments, the bands " + std::to_string(writer_->fragmentsSeen()) +
                        ", the layers " + std::to_string(writer_->fragmentsWritten()),
                    path_, "please report this with the scene");
    }
    ExrPartsSink::finish();
}

ExrCompositeWriter::ExrCompositeWriter(std::string path, OutputOptions options)
    : ExrPartsSink(std::move(path), std::move(options)) {
    // The options for layout and compression apply only to layered files.
    options_.layout.clear();
    options_.compression.clear();
}

void ExrCompositeWriter::begin(const Plan& plan) {
    writer_ = std::make_unique<ExrBandWriter>(std::vector{path_}, partsOf(plan), plan, options_);
}

std::vector<ExrPart> ExrCompositeWriter::partsOf(const Plan& plan) const {
    return {{.name = "composite", .window = plan.view.crop, .nearest_channels = true}};
}

}  // namespace peeler
