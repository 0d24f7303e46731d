// SPDX-License-Identifier: Apache-2.0
// One part, no layers.
#include "formats/exr/exr_composite_writer.h"

#include <utility>

namespace peeler {

ExrCompositeWriter::ExrCompositeWriter(std::string path, Provenance provenance,
                                       ExrBandOptions options)
    : path_(std::move(path)), provenance_(std::move(provenance)), options_(options) {}

ExrCompositeWriter::~ExrCompositeWriter() = default;

void ExrCompositeWriter::begin(const Plan& plan) {
    std::vector<ExrPart> parts = {{.name = "composite", .window = plan.view.crop}};
    writer_ = std::make_unique<ExrBandWriter>(std::vector{path_}, std::move(parts), plan,
                                              provenance_, options_);
}

void ExrCompositeWriter::write(LayeredImage&& band) {
    writer_->write(band);
}

void ExrCompositeWriter::finish() {
    writer_->finish();
    times_ = writer_->times();
    writer_.reset();
}

}  // namespace peeler
