// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/progress_lines.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "cmd/cli/console.h"
#include "core/base/printable.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {
constexpr double kBarSeconds = 0.05;
constexpr double kPlainSeconds = 1, kPlainShare = 0.1;
constexpr double kLineSeconds = 0.1;
}  // namespace

void ProgressLines::begin(const RunProgress& progress) {
    start_ = last_ = mark_ = clock_();
    shown_ = false;
    mark_share_ = mark_rate_ = 0;
    last_share_ = 0;
    status(progress.stage);
    if (style_ == ProgressStyle::kJson || style_ == ProgressStyle::kAlf ||
        style_ == ProgressStyle::kOpenJd)
        update(progress);
}

void ProgressLines::update(const RunProgress& progress) {
    switch (style_) {
        case ProgressStyle::kNone:
            return;
        case ProgressStyle::kJson:
            return json(progress);
        case ProgressStyle::kPlain:
            return plain(progress);
        case ProgressStyle::kAlf:
            return alf(progress.of_run);
        case ProgressStyle::kOpenJd:
            return openJd(progress.of_run);
        case ProgressStyle::kAuto:
            return console_.terminal() ? bar(progress) : plain(progress);
    }
}

void ProgressLines::status(std::string_view text) {
    if (style_ == ProgressStyle::kOpenJd) console_.machineLine("openjd_status: " + printable(text));
}

void ProgressLines::bar(const RunProgress& progress) {
    const double share = progress.of_stage;
    if (shown_ && share < 1 && secondsSince(last_) < kBarSeconds) return;
    constexpr int kCells = 30;
    const int full = static_cast<int>(std::floor(share * kCells));
    const int percent = static_cast<int>(std::floor(share * 100));
    std::string text = std::string(progress.stage) + " [" +
                       std::string(static_cast<std::size_t>(full), '#') +
                       std::string(static_cast<std::size_t>(kCells - full), '.') + "] " +
                       std::to_string(percent) + " %";
    if (const double left = secondsLeft(share); left > 0)
        text += ", " + std::to_string(std::lround(left)) + " s left";
    console_.bar(text);
    shown_ = true;
    last_ = clock_();
}

/// Returns the estimated seconds to the end of the stage; 0 = unknown. The estimate uses the
/// stage's mean rate or its latest rate, whichever is slower.
double ProgressLines::secondsLeft(double share) {
    // The latest rate is measured over at least 2 s and at least a quarter of the time spent.
    constexpr double kLeastSeconds = 2, kLatest = 0.25;
    const double spent = secondsSince(start_), since_mark = secondsSince(mark_);
    if (since_mark >= std::max(kLeastSeconds, kLatest * spent)) {
        mark_rate_ = (share - mark_share_) / since_mark;
        mark_share_ = share;
        mark_ = clock_();
    }
    if (!(share > 0 && share < 1 && mark_rate_ > 0)) return 0;
    return (1 - share) / std::min(mark_rate_, share / spent);
}

void ProgressLines::plain(const RunProgress& progress) {
    const double share = progress.of_stage;
    // A stage prints a last line only if it has printed earlier lines. Otherwise, the next output
    // shows that the stage has ended.
    const bool ends = share >= 1 && last_share_ > 0 && last_share_ < 1;
    if (!ends && (share >= 1 || secondsSince(last_) < kPlainSeconds ||
                  share - last_share_ < kPlainShare - 1e-9))
        return;
    const int percent = static_cast<int>(std::floor(share * 100 + 1e-9));
    console_.note(std::string(progress.stage) + " " + std::to_string(percent) + " %");
    last_share_ = share;
    last_ = clock_();
}

void ProgressLines::json(const RunProgress& progress) {
    const double share = progress.of_stage;
    if (shown_ && (share <= last_share_ || (share < 1 && secondsSince(last_) < kLineSeconds)))
        return;
    nlohmann::ordered_json line;
    line["stage"] = progress.stage;
    line["progress"] = share;
    line["seconds"] = std::round(secondsSince(start_) * 1e3) / 1e3;
    console_.machineLine(dumpJson(line));
    shown_ = true;
    last_share_ = share;
    last_ = clock_();
}

void ProgressLines::alf(double of_run) {
    const auto percent = [](double part) {
        return static_cast<int>(std::floor(part * 100 + 1e-9));
    };
    if (percent(of_run) <= percent(shown_run_)) return;
    console_.machineLine("ALF_PROGRESS " + std::to_string(percent(of_run)) + "%");
    shown_run_ = of_run;
}

void ProgressLines::openJd(double of_run) {
    const bool first = shown_run_ < 0, end = of_run >= 1 && shown_run_ < 1;
    const bool news = of_run - shown_run_ >= 1e-3 && secondsSince(last_) >= kLineSeconds;
    if (!first && !end && !news) return;
    char text[16];
    std::snprintf(text, sizeof text, "%.1f", std::floor(of_run * 1000 + 1e-6) / 10);
    console_.machineLine(std::string("openjd_progress: ") + text);
    shown_run_ = of_run;
    last_ = clock_();
}

double ProgressLines::secondsSince(std::chrono::steady_clock::time_point time) const {
    return std::chrono::duration<double>(clock_() - time).count();
}

}  // namespace peeler::cmd
