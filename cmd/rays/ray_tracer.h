// SPDX-License-Identifier: Apache-2.0
// From bundles of rays to one output, and to what is told of it.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cmd/options/capture_job.h"
#include "cmd/options/forecast.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/rays/ray_parity.h"
#include "cmd/rays/rays_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The bundles that go into one output, and what becomes of them.
struct RayTrace {
    OutputRequest output;
    std::optional<std::size_t> view{};  ///< of one output a view, which the bundle is called by
    std::vector<Bundle> bundles{};
    nlohmann::json settings = nlohmann::json::object();  ///< that change hits, besides the options
    std::vector<std::unique_ptr<RayOutput>> outputs{};
    const RayParity* parity = nullptr;           ///< one of outputs; null without --parity
    std::vector<std::filesystem::path> files{};  ///< the files that are written
    std::vector<CapturePlan> plans{};   ///< of each bundle; empty if no output needs hits first
    std::vector<std::uint64_t> hits{};  ///< of each bundle; empty if no output needs them first
    Forecast forecast{};
    std::uint64_t hits_found = 0;
    double largest_correction = 0;
    bool failed = false;  ///< --parity fail found an odd ray: no file is written
};

/// Traces one output after the other, in a scene that may be another one each time. make() lists
/// the stages.
class RayTracer {
  public:
    /// All of these must outlive it.
    RayTracer(const RaysOptions& options, CaptureJob& job, SequenceResults& results,
              Reporter& reporter);

    /// What is traced from here on. `scene` must outlive it.
    void setScene(const OpenedScene& scene, const PosedScene& posed);
    const PosedScene& posed() const { return *posed_; }
    /// The bundles are those of this lattice, for --voxels.
    void setLattice(const AxisBundles& lattice) { lattice_ = lattice; }

    /// Of all that decides what is in the file of a view.
    std::string hashOf(const RayTrace& trace) const;
    /// Writes the output and reports it, or tells of it under --dry-run. Throws Error.
    void make(RayTrace& trace);
    /// Leaves what a failure may have left in any state.
    void discard();

  private:
    std::string settingsHash(const RayTrace& trace, const CaptureSettings& capture) const;
    void nameFiles(RayTrace& trace) const;
    void openOutputs(RayTrace& trace);
    std::unique_ptr<RayOutput> makeOutput(const RayTrace& trace);
    void forecastMemory(const RayTrace& trace, std::size_t bundle, const CapturePlan& plan,
                        std::uint64_t left = 0);
    void count(RayTrace& trace);
    void describe(const RayTrace& trace);
    void traceBundles(RayTrace& trace);
    void report(RayTrace& trace);

    const Solids& solids() {
        if (!solids_) solids_ = std::make_unique<Solids>(*posed_);
        return *solids_;
    }

    const RaysOptions& options_;
    CaptureJob& job_;
    SequenceResults& results_;
    Reporter& reporter_;
    CaptureSettings capture_;
    const OpenedScene* scene_ = nullptr;
    std::optional<PosedScene> posed_;
    std::optional<AxisBundles> lattice_;
    std::unique_ptr<Solids> solids_;     ///< if something needs them
    HitSource* source_ = nullptr;        ///< owned by job_; null before the first output
    std::uint64_t memory_forecast_ = 0;  ///< bytes, of the run so far
};

}  // namespace peeler::cmd
