// SPDX-License-Identifier: Apache-2.0
#include "core/bake/bake.h"

#include <algorithm>

#include <peeler/bundle.h>
#include "core/bake/bundle_gather.h"
#include "core/bake/gather.h"
#include "core/bake/integrators.h"
#include "core/bake/line_gather.h"
#include "core/base/memory_budget.h"
#include "core/base/process_memory.h"

namespace peeler {

void checkReceiverMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget) {
    checkMemory(budget, usedBytes(budget) + bytes,
                "for the scene and its " + std::to_string(receivers) + " receivers",
                "; or bake fewer vertices or texels");
}

namespace {

/// The settings, receivers and sums of one bake.
struct BakeState {
    BakeState(HitSource& hits, const Receivers& seers, const BakeSettings& settings,
              const CaptureSettings& asked, const SurfaceLookup& lookup)
        : source(hits),
          receivers(seers),
          components(componentsOf(settings.quantity)),
          integrator(makeIntegrator(settings, {hits.posed(), lookup})),
          capture(asked) {
        checkReceiverMemory(seers.size() * sizeof(Sum) + (1 + keptCopies()) * valueBytes(),
                            seers.size(), asked.memory);
        values.resize(seers.size() * components);
        capture.hit_mode = HitMode::kSloped;
        capture.depth_clamp = true;
        capture.color_type = PixelType::kFloat;
        capture.channels = integrator->channels();
        by_lines = hits.prefersLines() && capture.channels.empty();
        directions = hemisphereDirections(std::max(1, settings.directions / 2));
        sums.resize(seers.size());
    }

    /// Returns the number of additional copies of the values (0 or 1). From the second round on,
    /// the integrator needs the values of the previous round.
    std::uint64_t keptCopies() const { return integrator->rounds() > 1 ? 1 : 0; }
    std::uint64_t valueBytes() const { return receivers.size() * components * sizeof(float); }
    bool empty() const { return !source.posed().bounds(); }

    HitSource& source;
    const Receivers& receivers;
    std::size_t components;
    std::unique_ptr<Integrator> integrator;
    CaptureSettings capture;
    bool by_lines = false;
    std::vector<glm::dvec3> directions;
    std::vector<Sum> sums;
    std::vector<float> values;
};

}  // namespace

std::vector<float> bake(HitSource& source, const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress, const ReportMemory& tell) {
    BakeState s(source, receivers, settings, capture, lookup);
    if (s.empty()) return std::move(s.values);
    std::vector<float> gathered;
    for (int round = 0; round < s.integrator->rounds(); ++round) {
        // The first report includes the memory that later rounds add.
        const std::uint64_t to_come = round == 0 ? s.keptCopies() * s.valueBytes() : 0;
        GatherJob job{receivers, settings, *s.integrator, s.directions};
        if (tell) job.tell = [&](std::uint64_t bytes) { tell(bytes + to_come); };
        if (round > 0) gathered = s.values;
        s.integrator->beginRound(gathered);
        s.sums.assign(receivers.size(), {});
        const Progress of_round = [&](double share) {
            if (progress) progress((round + share) / s.integrator->rounds());
        };
        if (s.by_lines)
            gatherByLines(source.posed(), s.capture, job, s.sums, of_round);
        else
            gatherByBundles(source, s.capture, job, s.sums, of_round);
        for (std::size_t r = 0; r < receivers.size(); ++r)
            s.integrator->finish(s.sums[r], s.values.data() + r * s.components);
    }
    return std::move(s.values);
}

std::uint64_t forecastBake(HitSource& source, const Receivers& receivers,
                           const BakeSettings& settings, const CaptureSettings& capture,
                           const Progress& progress) {
    const SurfaceLookup nobody_looks;
    BakeState s(source, receivers, settings, capture, nobody_looks);
    if (s.empty()) return residentBytes();
    const GatherJob job{receivers, settings, *s.integrator, s.directions};
    const std::uint64_t most = s.by_lines ? forecastLines(source.posed(), s.capture, job)
                                          : forecastBundles(source, s.capture, job, progress);
    return most + s.keptCopies() * s.valueBytes();
}

}  // namespace peeler
