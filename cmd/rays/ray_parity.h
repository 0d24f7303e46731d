// SPDX-License-Identifier: Apache-2.0
// The check that rays leave every solid as often as they enter it (--parity).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cmd/session/reporter.h"
#include "core/rays/solids.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// Returns a solid's name: "Lid", or "Lid, primitives 0, 2" if the mesh has other solids, too.
std::string solidName(const Scene& scene, const Solid& solid);

/// A counter of each ray's hits per solid. finish() warns of solids that a ray hits an odd number
/// of times, and notes whether all solids are closed. Writes no file. All arguments must outlive
/// this object.
class RayParity : public RayOutput {
  public:
    RayParity(const Scene& scene, const Solids& solids, Reporter& reporter)
        : scene_(scene), solids_(solids), reporter_(reporter), parity_(solids) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override { parity_.add(bundle, band); }
    void finish() override;
    bool holds() const { return parity_.holds(); }
    /// Throws Error (kInput) with the solids that are not closed. Must not be called if holds().
    [[noreturn]] void fail() const;
    /// Adds "parity" to a result, with an entry for each solid that was hit (cmd/README.md,
    /// "JSON").
    void addTo(nlohmann::ordered_json& result) const;

  private:
    std::string describe(const Solid& solid, const SolidParity& parity) const;
    std::string verdict(std::size_t odd_solids) const;

    const Scene& scene_;
    const Solids& solids_;
    Reporter& reporter_;
    std::vector<Bundle> bundles_;
    Parity parity_;
};

}  // namespace peeler::cmd
