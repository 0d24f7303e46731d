// SPDX-License-Identifier: Apache-2.0
// Runs that make several frames or views: existing files, failures and results.
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

struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
    std::optional<Shard> chunk{};  ///< the pictures that this run makes; none = all
};

/// Declares --chunk, --skip-existing and --keep-going. `options` must outlive the parse.
void addSequenceOptions(VerbOptions& verb, SequenceOptions& options);

/// The number of a picture: frame, view, or both.
struct PictureNumber {
    std::optional<int> frame{};  ///< set in a sequence
    std::optional<int> view{};   ///< set if there are several views; by default from 0

    /// Returns "frame 12, view 3"; "" for a single picture.
    std::string text() const;
};

/// The results of a run's pictures. Each result is reported when its picture is finished; all
/// results are reported at the end.
class SequenceResults {
  public:
    /// `pictures` is the noun for the pictures, "frame" or "view"; "" for a single picture. The
    /// reporter must outlive this object.
    SequenceResults(std::string pictures, Reporter& reporter)
        : pictures_(std::move(pictures)), reporter_(reporter) {}

    /// Adds a picture's result. `line` is the summary to report; "" = already reported.
    void add(Json result, const std::string& line);
    /// Reports that a picture has failed and that the run continues.
    void addFailure(const std::filesystem::path& output, const PictureNumber& number,
                    const Error& error);

    bool empty() const { return finished_.empty() && failed_.empty(); }
    int worst() const { return worst_; }  ///< the greatest exit code of a failure; 0 = none
    /// Returns {"frames": [one result per frame]} or {"views": [one result per view]}, with
    /// "failed" if any failed. For a single picture, returns only its result.
    Json json() const;
    /// Reports the number of failed pictures, if there are any.
    void reportFailures() const;

  private:
    std::string pictures_;
    Reporter& reporter_;
    std::vector<Json> finished_, failed_;
    int worst_ = 0;
};

/// Calls `make(i)` for each picture i in [first, end); `number(i)` is the picture's number. If
/// `make` throws under --keep-going, calls `discard`, adds the failure to `results` and continues.
/// `discard` discards state that the failure may have corrupted, and returns the path of the
/// missing file. Rethrows all errors without --keep-going, and always errors of kind kUsage, which
/// concern all pictures.
void makeEach(std::size_t first, std::size_t end, const SequenceOptions& options,
              SequenceResults& results, const std::function<PictureNumber(std::size_t)>& number,
              const std::function<void(std::size_t)>& make,
              const std::function<std::filesystem::path(std::size_t)>& discard);

/// Calls makeEach() with the indices of views as numbers.
void makeEachView(std::size_t first, std::size_t end, const SequenceOptions& options,
                  SequenceResults& results, const std::function<void(std::size_t)>& make,
                  const std::function<std::filesystem::path(std::size_t)>& discard);

}  // namespace peeler::cmd
