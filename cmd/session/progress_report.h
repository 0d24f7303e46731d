// SPDX-License-Identifier: Apache-2.0
// The progress of one stage of a run.
#pragma once

#include <string>
#include <utility>

#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// A stage of a run that takes a while.
struct Stage {
    Stage(std::string stage_name, double ends_at = 1) : name(std::move(stage_name)), end(ends_at) {}
    Stage(const char* stage_name) : Stage(std::string(stage_name)) {}

    std::string name;
    double end;  ///< share of the run that is done after it; 1 = all
};

/// Share of the run that is done after a count that comes before the work.
inline constexpr double kCountEnd = 0.3;

/// Reports one stage, from construction to destruction. Stages follow one another, and each goes on
/// where the one before has ended.
class ProgressReport {
  public:
    /// The reporter must outlive the report.
    ProgressReport(Reporter& reporter, Stage stage);
    ~ProgressReport();
    ProgressReport(const ProgressReport&) = delete;
    ProgressReport& operator=(const ProgressReport&) = delete;

    /// Reports that `share` of the stage is done, 0 to 1.
    void update(double share);
    void status(const std::string& text) { reporter_.status(text); }

  private:
    Reporter& reporter_;
    Stage stage_;
    double begin_;  ///< share of the run that was done before
};

}  // namespace peeler::cmd
