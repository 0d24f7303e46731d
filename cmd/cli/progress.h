// SPDX-License-Identifier: Apache-2.0
// How far a long stage is: a bar, lines now and then, or lines for a scheduler.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "cmd/cli/choices.h"
#include "cmd/cli/console.h"

namespace peeler::cmd {

/// How progress is reported.
enum class ProgressStyle { kAuto, kNone, kPlain, kAlf, kOpenJd, kJson };

/// The default comes first.
inline constexpr Choice<ProgressStyle> kProgressStyles[] = {
    {"auto", ProgressStyle::kAuto, "a bar on a terminal, else plain"},
    {"none", ProgressStyle::kNone, "nothing"},
    {"plain", ProgressStyle::kPlain, "a line now and then"},
    {"alf", ProgressStyle::kAlf, "ALF_PROGRESS lines: Tractor, Afanasy"},
    {"openjd", ProgressStyle::kOpenJd, "openjd_progress and openjd_status lines: Deadline Cloud"},
    {"json", ProgressStyle::kJson, "JSON lines, stage by stage"},
};

/// The stage of a command that a ProgressReport is of.
struct Stage {
    Stage(std::string stage_name, double ends_at = 1) : name(std::move(stage_name)), end(ends_at) {}
    Stage(const char* stage_name) : Stage(std::string(stage_name)) {}

    std::string name;
    double end;  ///< share of the command that is done after it; 1 = all
};

/// Share of the command that is done after a count that comes before the work.
inline constexpr double kCountEnd = 0.3;

/// One stage's progress, from construction to destruction, on the console's stderr.
/// - bar (auto on a terminal): redrawn at most 20 times a second, cleared at the end
/// - plain: a line at most once for every 10 % and once a second, so a short stage says nothing
/// - json: {"stage":…,"progress":0–1,"seconds":…}: the first (0), the last (1), and between them
///   at most 10 a second
/// - alf: "ALF_PROGRESS 42%", a line for every per cent (Pixar's Tractor; CGRU's Afanasy reads it)
/// - openjd: "openjd_progress: 42.0" and "openjd_status: …" (Open Job Description, "How Jobs Are
///   Run", Stdout/Stderr Messages), at most 10 a second
/// The last two are of the command as a whole: they never fall, and a stage goes on where the one
/// before has ended. Quiet consoles get nothing but these and JSON, which were asked for by name.
class ProgressReport {
  public:
    using Clock = std::function<std::chrono::steady_clock::time_point()>;

    /// The stage begins. The console must outlive the report.
    ProgressReport(Console& console, ProgressStyle style, Stage stage,
                   Clock clock = std::chrono::steady_clock::now);
    ~ProgressReport();
    ProgressReport(const ProgressReport&) = delete;
    ProgressReport& operator=(const ProgressReport&) = delete;

    /// Reports that `share` of the stage is done, 0 to 1.
    void update(double share);
    /// Says what is being done, in a few words, in styles that can say it.
    void status(const std::string& text);

  private:
    void bar(double share);
    void plain(double share);
    void json(double share);
    void alf(double share);
    void openJd(double share);
    double secondsSince(std::chrono::steady_clock::time_point time) const;

    Console& console_;
    ProgressStyle style_;
    Stage stage_;
    Clock clock_;
    std::chrono::steady_clock::time_point start_, last_;
    double begin_;           ///< share of the command that was done before
    bool shown_ = false;     ///< whether anything has been shown
    double last_share_ = 0;  ///< share of the stage in the last line
};

}  // namespace peeler::cmd
