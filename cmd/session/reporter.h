// SPDX-License-Identifier: Apache-2.0
// The messages, the progress and the result of a run, as each door takes them.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>

#include <peeler/error.h>

namespace peeler::cmd {

/// A result as JSON: keys stay in the order in which they are set.
using Json = nlohmann::ordered_json;

enum class Severity : std::uint8_t {
    kDetail,   ///< the course of the work, for those who ask for it
    kNote,     ///< worth knowing for a person; a script does not need it
    kHint,     ///< advice; may have several lines
    kWarning,  ///< something was done differently than one might expect
    kError,    ///< the run fails, or this part of it
};

/// How a door shows progress.
enum class ProgressStyle : std::uint8_t { kAuto, kNone, kPlain, kAlf, kOpenJd, kJson };

/// The share of a run that is done.
struct RunProgress {
    std::string_view stage;  ///< "render", "trace"
    double of_stage = 0;     ///< 0 to 1
    double of_run = 0;       ///< 0 to 1, never falling
};

/// Takes everything that a run reports: the command line prints it, the worker sends it on. Belongs
/// to one thread.
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
    /// A note about the whole run: the same text is reported once.
    void noteOnce(const std::string& text) {
        if (noted_.insert(text).second) note(text);
    }

    /// An error that ends the run, or a picture of it, with its hint.
    virtual void failure(const Error& error) = 0;
    /// The result that was asked for, as data. Throws Error (kOutput).
    virtual void result(const Json& result) = 0;
    void result(std::string_view) = delete;  // which would become a string of JSON
    /// The same as a text for people. Throws likewise.
    virtual void text(std::string_view text) = 0;

    /// A stage begins; the calls of progress() that follow are of it until it ends. What progress()
    /// throws gives the work up.
    virtual void beginStage(const RunProgress& /*progress*/) {}
    virtual void progress(const RunProgress& /*progress*/) {}
    /// What is being done, in a few words: "frame 3, 3 of 24".
    virtual void status(std::string_view /*text*/) {}
    virtual void endStage() {}

    virtual void setProgress(ProgressStyle /*style*/) {}
    /// Leaves out notes and details.
    void setQuiet(bool quiet) { quiet_ = quiet; }
    void setVerbose(bool verbose) { verbose_ = verbose; }
    bool quiet() const { return quiet_; }

    /// The share of the run that is done, which its stages go on from.
    double done() const { return done_; }

  protected:
    friend class ProgressReport;

    virtual void message(Severity severity, const Text& text) = 0;
    /// Whether a message of this severity is asked for.
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
