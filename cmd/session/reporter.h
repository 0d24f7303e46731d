// SPDX-License-Identifier: Apache-2.0
// The reporter interface: messages, progress and result of a run.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>

#include <peeler/error.h>

namespace peeler::cmd {

/// JSON that keeps keys in insertion order.
using Json = nlohmann::ordered_json;

enum class Severity : std::uint8_t {
    kDetail,   ///< a step of the work, for --verbose
    kNote,     ///< interesting to people, but not to scripts
    kHint,     ///< advice, possibly in several lines
    kWarning,  ///< a result may differ from the user's expectation
    kError,    ///< the run or a part of it fails
};

enum class ProgressStyle : std::uint8_t { kAuto, kNone, kPlain, kAlf, kOpenJd, kJson };

struct RunProgress {
    std::string_view stage;
    double of_stage = 0;  ///< 0 to 1
    double of_run = 0;    ///< 0 to 1, never decreasing
};

/// The receiver of all reports of a run: the command line prints the reports, the worker forwards
/// them. Each Reporter must be used by only one thread.
class Reporter {
  public:
    Reporter() = default;
    virtual ~Reporter() = default;
    Reporter(const Reporter&) = delete;
    Reporter& operator=(const Reporter&) = delete;

    void detail(const Text& text) { message(Severity::kDetail, text); }
    void note(const Text& text) { message(Severity::kNote, text); }
    void hint(const Text& text) { message(Severity::kHint, text); }
    void warning(const Text& text) { message(Severity::kWarning, text); }
    void error(const Text& text) { message(Severity::kError, text); }
    /// Reports a note about the whole run. Does nothing if the same note was already reported.
    void noteOnce(const std::string& text) {
        if (noted_.insert(text).second) note(text);
    }

    /// Reports an error that ends the run or one of its pictures, and the error's hint.
    virtual void failure(const Error& error) = 0;
    /// Reports the result for --json. Throws Error (kOutput) if the result cannot be written.
    virtual void result(const Json& result) = 0;
    void result(std::string_view) = delete;  // the text would become a JSON string
    /// Writes a result as text for people. Throws like result().
    virtual void text(std::string_view text) = 0;

    /// Begins a stage. Until endStage(), progress() refers to this stage. An exception from
    /// progress() cancels the work.
    virtual void beginStage(const RunProgress& /*progress*/) {}
    virtual void progress(const RunProgress& /*progress*/) {}
    /// Reports the current activity in a few words: "frame 3, 3 of 24".
    virtual void status(std::string_view /*text*/) {}
    virtual void endStage() {}

    virtual void setProgress(ProgressStyle /*style*/) {}
    /// Suppresses notes and details.
    void setQuiet(bool quiet) { quiet_ = quiet; }
    void setVerbose(bool verbose) { verbose_ = verbose; }
    bool quiet() const { return quiet_; }

    /// Returns the share of the run that earlier stages have done, 0 to 1.
    double done() const { return done_; }

  protected:
    friend class ProgressReport;

    virtual void message(Severity severity, const Text& text) = 0;
    bool shows(Severity severity) const {
        if (severity >= Severity::kHint) return true;
        return !quiet_ && (severity == Severity::kNote || verbose_);
    }

  private:
    bool quiet_ = false, verbose_ = false;
    double done_ = 0;
    std::set<std::string> noted_;
};

}  // namespace peeler::cmd
