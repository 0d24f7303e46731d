// SPDX-License-Identifier: Apache-2.0
// Progress reports of stages.
#pragma once

#include <string>
#include <utility>

#include "cmd/session/reporter.h"

namespace peeler::cmd {

struct Stage {
    Stage(std::string stage_name, double ends_at = 1) : name(std::move(stage_name)), end(ends_at) {}
    Stage(const char* stage_name) : Stage(std::string(stage_name)) {}

    std::string name;
    double end;  ///< share of the run that is done after this stage, 0 to 1
};

/// The end of a count pass that precedes the main pass, as a share of the run.
inline constexpr double kCountEnd = 0.3;

/// A progress report for one stage. The stage begins at construction and ends at destruction. In
/// the run, each stage starts where the previous stage ended.
class ProgressReport {
  public:
    /// The reporter must outlive this object.
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
    double begin_;  ///< share of the run that was done before this stage
};

}  // namespace peeler::cmd
