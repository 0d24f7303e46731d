// SPDX-License-Identifier: Apache-2.0
// Ray tracer: traces bundles, writes the output files and reports them.
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
#include "cmd/rays/undecided_solids.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The bundles of one output, and their results.
struct RayTrace {
    OutputRequest output;
    std::optional<std::size_t> view{};  ///< index of the view, if each view has its own output
    std::vector<Bundle> bundles{};
    /// Settings that change hits, other than the options.
    nlohmann::json settings = nlohmann::json::object();
    std::vector<std::unique_ptr<RayOutput>> outputs{};
    const RayParity* parity = nullptr;    ///< one of `outputs`; null without --parity
    std::optional<double> median_path{};  ///< set if the attenuation is computed from it
    std::vector<std::filesystem::path> files{};
    std::vector<CapturePlan> plans{};  ///< one plan per bundle; empty if hits are not counted first
    /// Number of hits of each bundle; empty if hits are not counted first.
    std::vector<std::uint64_t> hits{};
    Forecast forecast{};
    std::uint64_t hits_found = 0, without_ray = 0;
    double largest_correction = 0;
    /// Whether --parity fail found a ray with an odd number of hits. No file is written then.
    bool failed = false;
};

/// A tracer that makes one output after another. The scene may change in between. make() lists the
/// stages.
class RayTracer {
  public:
    /// All arguments must outlive the tracer.
    RayTracer(const RaysOptions& options, CaptureJob& job, SequenceResults& results,
              Reporter& reporter);

    /// Sets the scene for the following outputs. `scene` must outlive the tracer.
    void setScene(const OpenedScene& scene, const PosedScene& posed);
    const PosedScene& posed() const { return *posed_; }
    /// Sets the lattice of the bundles, for --voxels.
    void setLattice(const AxisBundles& lattice) { lattice_ = lattice; }

    /// Returns the hash of everything that determines the content of a view's file.
    std::string hashOf(const RayTrace& trace) const;
    /// Traces the bundles, writes the output and reports it. In a dry run, only reports the plan.
    void make(RayTrace& trace);
    /// Discards state that a failure may have corrupted.
    void discard();

  private:
    std::string settingsHash(const RayTrace& trace, const CaptureSettings& capture) const;
    void nameFiles(RayTrace& trace) const;
    void openOutputs(RayTrace& trace);
    void findAttenuation(RayTrace& trace);
    void reportUndecided();
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
    std::unique_ptr<Solids> solids_;                        ///< made when needed
    std::optional<std::vector<UndecidedSolid>> undecided_;  ///< set once reported
    HitSource* source_ = nullptr;        ///< owned by job_; null until the first output
    std::uint64_t memory_forecast_ = 0;  ///< bytes; the maximum over all outputs so far
};

}  // namespace peeler::cmd
