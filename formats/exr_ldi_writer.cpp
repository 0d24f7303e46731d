// SPDX-License-Identifier: Apache-2.0
// The parts of a layered depth image.
#include "formats/exr_ldi_writer.h"

#include <algorithm>
#include <utility>

#include "core/error.h"

namespace peeler {

std::string layerName(std::size_t layer) {
    constexpr std::size_t kDigits = 3;
    const std::string number = std::to_string(layer);
    return "layer_" + std::string(kDigits - std::min(kDigits, number.size()), '0') + number;
}

ExrLdiWriter::ExrLdiWriter(std::string path, Provenance provenance, ExrLdiOptions options)
    : path_(std::move(path)), provenance_(std::move(provenance)), options_(options) {}

ExrLdiWriter::~ExrLdiWriter() = default;

void ExrLdiWriter::begin(const Plan& plan) {
    std::vector<ExrPart> parts;
    if (options_.composite || plan.layers.empty()) {
        parts.push_back({"composite", plan.view.crop, ExrPart::kComposite});
    }
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        const Window& window = plan.layers[i].data_window;
        if (window.empty() || intersect(window, plan.view.crop) != window) {
            throw Error(ErrorKind::kInternal, "a layer's window is empty or outside the crop",
                        layerName(i));
        }
        parts.push_back({layerName(i), window, static_cast<int>(i)});
    }
    fragments_planned_ = plan.fragments_stored;
    writer_ = std::make_unique<ExrBandWriter>(
        path_, std::move(parts), plan, provenance_,
        ExrBandOptions{.level = options_.level, .cryptomatte = options_.cryptomatte});
}

void ExrLdiWriter::write(const LayeredImage& band) {
    writer_->write(band);
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
    writer_->finish();
    times_ = writer_->times();
    writer_.reset();
}

}  // namespace peeler
