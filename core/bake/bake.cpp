// SPDX-License-Identifier: Apache-2.0
#include "core/bake/bake.h"

#include <algorithm>

#include "core/bake/gather.h"
#include "core/bake/integrators.h"
#include "core/base/error.h"
#include "core/capture/bands.h"
#include "core/rays/bundle.h"

namespace peeler {

void checkReceiverMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget) {
    const std::uint64_t needed = usedBytes(budget) + bytes;
    if (budget == 0 || needed < budget) return;
    throw Error(ErrorKind::kMemory,
                "the memory budget is " + mebibytesText(budget) + ", and the scene and its " +
                    std::to_string(receivers) + " receivers take " + mebibytesText(needed),
                budget.where(), "raise it, or bake for fewer vertices or texels");
}

std::vector<float> bake(HitSource& source, const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress) {
    const std::size_t components = componentsOf(settings.quantity);
    const auto integrator = makeIntegrator(settings, {source.posed(), lookup});
    // The values of this round, and of the one before.
    const std::size_t kept = integrator->rounds() > 1 ? 2 : 1;
    checkReceiverMemory(receivers.size() * (sizeof(Sum) + kept * components * sizeof(float)),
                        receivers.size(), capture.memory);
    std::vector<float> values(receivers.size() * components);
    if (!source.posed().bounds()) return values;
    CaptureSettings hits = capture;
    hits.hit_mode = HitMode::kSloped;
    hits.depth_clamp = true;
    hits.color_type = PixelType::kFloat;
    hits.channels = integrator->channels();
    const bool by_lines = source.prefersLines() && hits.channels.empty();
    const auto directions = hemisphereDirections(std::max(1, settings.directions / 2));
    const GatherJob job{receivers, settings, *integrator, directions};
    std::vector<Sum> sums(receivers.size());
    std::vector<float> gathered;
    for (int round = 0; round < integrator->rounds(); ++round) {
        if (round > 0) gathered = values;
        integrator->beginRound(gathered);
        sums.assign(receivers.size(), {});
        const Progress of_round = [&](double share) {
            if (progress) progress((round + share) / integrator->rounds());
        };
        if (by_lines)
            gatherByLines(source.posed(), hits, job, sums, of_round);
        else
            gatherByBundles(source, hits, job, sums, of_round);
        for (std::size_t r = 0; r < receivers.size(); ++r)
            integrator->finish(sums[r], values.data() + r * components);
    }
    return values;
}

}  // namespace peeler
