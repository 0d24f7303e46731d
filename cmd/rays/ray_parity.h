// SPDX-License-Identifier: Apache-2.0
// rays --parity: solids that rays enter and do not leave.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cmd/cli/console.h"
#include "core/rays/solids.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// finish() warns of every solid that rays hit an odd number of times. Writes no file. Everything
/// referred to must outlive it.
class RayParity : public RayOutput {
  public:
    RayParity(const Scene& scene, const Solids& solids, Console& console)
        : scene_(scene), solids_(solids), console_(console), parity_(solids) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override { parity_.add(bundle, band); }
    void finish() override;
    bool holds() const { return parity_.holds(); }
    /// Throws Error (kInput) that says what does not hold.
    [[noreturn]] void fail() const;
    /// "parity": {"holds", "oddRays", "solids": [of each that is hit]}.
    void tell(nlohmann::ordered_json& result) const;

  private:
    std::string name(const Solid& solid) const;
    std::string describe(const Solid& solid, const SolidParity& parity) const;

    const Scene& scene_;
    const Solids& solids_;
    Console& console_;
    std::vector<Bundle> bundles_;
    Parity parity_;
};

}  // namespace peeler::cmd
