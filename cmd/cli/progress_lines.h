// SPDX-License-Identifier: Apache-2.0
// Progress on stderr: a bar, occasional lines, or lines for a scheduler.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "cmd/session/choices.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

class Console;

/// The progress styles by name. The first is the default.
inline constexpr Choice<ProgressStyle> kProgressStyles[] = {
    {"auto", ProgressStyle::kAuto, "bar on a terminal, else plain"},
    {"none", ProgressStyle::kNone, "nothing"},
    {"plain", ProgressStyle::kPlain, "occasional lines"},
    {"alf", ProgressStyle::kAlf, "ALF_PROGRESS lines for Tractor and Afanasy"},
    {"openjd", ProgressStyle::kOpenJd,
     "openjd_progress and openjd_status lines for Deadline Cloud"},
    {"json", ProgressStyle::kJson, "JSON lines with the stage"},
};

/// Shows the progress of successive stages on a Console's stderr:
/// - bar (auto on a terminal): redrawn at most 20 times per second, cleared at the end
/// - plain: at most one line per 10 % and per second, so a short stage prints nothing; a stage with
///   lines ends at 100 %
/// - json: {"stage":…,"progress":0–1,"seconds":…}: the first (0), the last (1), and between them at
///   most 10 per second
/// - alf: "ALF_PROGRESS 42%", one line per percent (read by Pixar's Tractor and CGRU's Afanasy)
/// - openjd: "openjd_progress: 42.0" and "openjd_status: …" (Open Job Description, "How Jobs Are
///   Run", Stdout/Stderr Messages), at most 10 a second
/// alf and openjd show the progress of the whole run, which never decreases.
class ProgressLines {
  public:
    using Clock = std::function<std::chrono::steady_clock::time_point()>;

    explicit ProgressLines(Console& console) : console_(console) {}

    void setStyle(ProgressStyle style) { style_ = style; }
    void setClock(Clock clock) { clock_ = std::move(clock); }

    void begin(const RunProgress& progress);
    void update(const RunProgress& progress);
    /// Shows the current activity, if the style has a line for it.
    void status(std::string_view text);

  private:
    void bar(const RunProgress& progress);
    double secondsLeft(double share);
    void plain(const RunProgress& progress);
    void json(const RunProgress& progress);
    void alf(double of_run);
    void openJd(double of_run);
    double secondsSince(std::chrono::steady_clock::time_point time) const;

    Console& console_;
    ProgressStyle style_ = ProgressStyle::kAuto;
    Clock clock_ = std::chrono::steady_clock::now;
    std::chrono::steady_clock::time_point start_, last_;
    std::chrono::steady_clock::time_point mark_;  ///< end of the measurement of mark_rate_
    double mark_share_ = 0, mark_rate_ = 0;       ///< share at mark_; latest rate, share per second
    bool shown_ = false;                          ///< whether this stage has printed a line
    double last_share_ = 0;                       ///< share of the stage in the last line
    /// Share of the run in the last line for a scheduler; negative = no line yet.
    double shown_run_ = -1;
};

}  // namespace peeler::cmd
