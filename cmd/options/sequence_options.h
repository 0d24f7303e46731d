// SPDX-License-Identifier: Apache-2.0
// Runs over many frames or views: existing files, failures, results.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

class VerbOptions;

/// Options for existing files and failures in a run over many pictures.
struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
    std::optional<Shard> chunk{};  ///< of all pictures
};

/// Declares --chunk, --skip-existing and --keep-going. `options` must outlive the parse.
void addSequenceOptions(VerbOptions& verb, SequenceOptions& options);

/// The frame and view of a picture.
struct PictureNumber {
    std::optional<int> frame{};  ///< in a sequence
    std::optional<int> view{};   ///< index among many views, from 0

    /// Returns "frame 12, view 3"; "" for a single picture.
    std::string text() const;
};

/// The results of a run's pictures, reported one by one and together at the end.
class SequenceResults {
  public:
    /// `pictures`: the noun for one of several, "frame" or "view"; "" = a single picture. The
    /// reporter must outlive this object.
    SequenceResults(std::string pictures, Reporter& reporter)
        : pictures_(std::move(pictures)), reporter_(reporter) {}

    /// Adds a result; `line` is its summary.
    void add(Json result, const std::string& line);
    /// Reports the failure of a picture; the run continues.
    void addFailure(const std::filesystem::path& output, const PictureNumber& number,
                    const Error& error);

    bool empty() const { return finished_.empty() && failed_.empty(); }
    int worst() const { return worst_; }  ///< the greatest exit code of a failure; 0 = none
    /// Returns {"frames": [one result per frame]}, or "views", and "failed" if any failed; for a
    /// single picture, its result.
    Json json() const;
    /// Reports the number of failed pictures, if any.
    void reportFailures() const;

  private:
    std::string pictures_;
    Reporter& reporter_;
    std::vector<Json> finished_, failed_;
    int worst_ = 0;
};

/// Calls `make` for each view in [first, end). Under --keep-going a failure is added to `results`
/// and the run continues, unless the whole request is at fault (kUsage); otherwise it is rethrown.
/// Calls `discard` first: it discards state that the failure may have corrupted, and returns the
/// missing file.
void makeEachView(std::size_t first, std::size_t end, const SequenceOptions& options,
                  SequenceResults& results, const std::function<void(std::size_t)>& make,
                  const std::function<std::filesystem::path(std::size_t)>& discard);

}  // namespace peeler::cmd
