// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/filtered_input.h"

#include <algorithm>
#include <utility>

#include <peeler/error.h>
#include "cmd/options/layered_bands.h"
#include "core/image/layers.h"

namespace peeler::cmd {

FilteredInput::FilteredInput(std::unique_ptr<LayeredInput> input, Filter filter)
    : input_(std::move(input)), filter_(std::move(filter)), info_(input_->info()) {
    DepthComplexity complexity(info_.plan.view.crop);
    Plan& plan = info_.plan;
    forEachBand(*this, kBandBytes, [&](const LayeredImage& band) {
        complexity.addBand(band);
        plan.tinted = band.tinted();
    });
    // Nothing is known about fragments that the file lacks, so assume that the filter keeps them.
    const std::uint64_t lacking =
        std::max(plan.fragments_counted, plan.fragments_stored) - plan.fragments_stored;
    plan.layers = complexity.layers();
    plan.fragments_stored = complexity.counted();
    plan.fragments_counted = plan.fragments_stored + lacking;
    info_.composite = -1;
    info_.has_cryptomatte = false;
    // peeler:outputHash describes an unfiltered picture.
    info_.parts.front().attributes.erase("peeler:outputHash");
}

void FilteredInput::read(const Window& window, LayeredImage& out) {
    input_->read(window, out);
    filter_(out);
}

void FilteredInput::readComposite(const Window& /*window*/, CompositeImage& /*out*/) {
    throw Error(ErrorKind::kInput, "objects cannot be chosen in a composite", "",
                "flatten the layers");
}

BandRead FilteredInput::mostOf(int rows) const {
    BandRead most = input_->mostOf(rows);
    most.counted = false;
    return most;
}

}  // namespace peeler::cmd
