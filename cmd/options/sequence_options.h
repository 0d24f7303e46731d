// SPDX-License-Identifier: Apache-2.0
// Runs over many pictures, frames and views: how they meet what is there already and what fails,
// and what becomes of each.
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

/// How a run over many pictures meets what is there already, and what fails.
struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
    std::optional<Shard> chunk{};  ///< of all pictures
};

/// Declares --chunk, --skip-existing and --keep-going. `options` must outlive the parse.
void addSequenceOptions(VerbOptions& verb, SequenceOptions& options);

/// Which of many pictures one is.
struct PictureNumber {
    std::optional<int> frame{};  ///< of a sequence
    std::optional<int> view{};   ///< of many views, from 0

    /// "frame 12, view 3"; "" of a lone picture.
    std::string text() const;
};

/// What became of the pictures of a run: reported as each ends, and together at the end.
class SequenceResults {
  public:
    /// `pictures`: what each of several is called, "frame" or "view"; "" = there is one. The
    /// reporter must outlive this object.
    SequenceResults(std::string pictures, Reporter& reporter)
        : pictures_(std::move(pictures)), reporter_(reporter) {}

    /// `line` is what is told of it.
    void add(Json result, const std::string& line);
    /// Reports the failure of a picture that the others go on without.
    void addFailure(const std::filesystem::path& output, const PictureNumber& number,
                    const Error& error);

    bool empty() const { return finished_.empty() && failed_.empty(); }
    int worst() const { return worst_; }  ///< the greatest exit code of a failure; 0 = none
    /// {"frames": [one result a frame]}, or "views", and, if there are any, "failed"; of a lone
    /// picture its result.
    Json json() const;
    /// Says how many pictures have failed, if any.
    void reportFailures() const;

  private:
    std::string pictures_;
    Reporter& reporter_;
    std::vector<Json> finished_, failed_;
    int worst_ = 0;
};

/// Calls `make` with the numbers of views from `first` to `end`, one after the other. Under
/// --keep-going a failure is listed in `results`, unless it is one of the whole request (kUsage),
/// and the next view follows; otherwise it is thrown. `discard` is called before: it leaves what
/// the failure may have left in any state, and says which file is missing.
void makeEachView(std::size_t first, std::size_t end, const SequenceOptions& options,
                  SequenceResults& results, const std::function<void(std::size_t)>& make,
                  const std::function<std::filesystem::path(std::size_t)>& discard);

}  // namespace peeler::cmd
