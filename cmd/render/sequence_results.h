// SPDX-License-Identifier: Apache-2.0
// What became of the pictures of a run: reported as each ends, and together at the end.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "cmd/options/output_options.h"
#include "core/base/error.h"

namespace peeler::cmd {

class SequenceResults {
  public:
    /// `sequence`: of frames; else there is one picture. Flags and console must outlive it.
    SequenceResults(const ReportOptions& flags, bool sequence, Console& console)
        : flags_(flags), sequence_(sequence), console_(console) {}

    void add(const PictureResult& result);
    /// Of a picture that the others go on without.
    void addFailure(const std::filesystem::path& output, std::optional<int> frame,
                    const Error& error);

    bool empty() const { return finished_.empty() && failed_.empty(); }
    int worst() const { return worst_; }  ///< exit code
    /// The results of a sequence as asked for: {"frames": [one result a frame]} and, if there are
    /// any, "failed". (A lone picture's are reported when it ends.)
    void report() const;

  private:
    const ReportOptions& flags_;
    bool sequence_;
    Console& console_;
    std::vector<PictureResult> finished_;
    std::vector<nlohmann::ordered_json> failed_;
    int worst_ = 0;
};

}  // namespace peeler::cmd
