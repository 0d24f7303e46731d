// SPDX-License-Identifier: Apache-2.0
// How far a long stage is: a bar, lines now and then, or JSON lines.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "cmd/choices.h"
#include "cmd/console.h"

namespace peeler::cmd {

/// One stage's progress, from construction to destruction, on the console's stderr.
/// - bar (auto on a terminal): redrawn at most 20 times a second, cleared at the end
/// - plain: a line at most once for every 10 % and once a second, so a short stage says nothing
/// - json: {"stage":…,"progress":0–1,"seconds":…}, the first (0), the last (1), between them at
/// most
///   10 a second
/// Quiet consoles get nothing but JSON, which was asked for by name.
class ProgressReport {
  public:
    using Clock = std::function<std::chrono::steady_clock::time_point()>;

    ProgressReport(Console& console, ProgressStyle style, std::string stage,
                   Clock clock = std::chrono::steady_clock::now);
    ~ProgressReport();
    ProgressReport(const ProgressReport&) = delete;
    ProgressReport& operator=(const ProgressReport&) = delete;

    /// `share` done, 0 to 1.
    void update(double share);

  private:
    void bar(double share);
    void plain(double share);
    void json(double share);
    double secondsSince(std::chrono::steady_clock::time_point time) const;

    Console& console_;
    ProgressStyle style_;
    std::string stage_;
    Clock clock_;
    std::chrono::steady_clock::time_point start_, last_;
    bool shown_ = false;     ///< anything at all
    double last_share_ = 0;  ///< of the last line
};

}  // namespace peeler::cmd
