// SPDX-License-Identifier: Apache-2.0
// When to say how far a stage is, and in which form.
#include "cmd/cli/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {
constexpr double kBarSeconds = 0.05;
constexpr double kPlainSeconds = 1, kPlainShare = 0.1;
constexpr double kLineSeconds = 0.1;
}  // namespace

ProgressReport::ProgressReport(Console& console, ProgressStyle style, Stage stage, Clock clock)
    : console_(console),
      style_(style),
      stage_(std::move(stage)),
      clock_(std::move(clock)),
      start_(clock_()),
      last_(start_),
      begin_(std::max(0.0, console.reported())) {
    if (style_ == ProgressStyle::kOpenJd) status(stage_.name);
    if (style_ == ProgressStyle::kJson || style_ == ProgressStyle::kAlf ||
        style_ == ProgressStyle::kOpenJd)
        update(0);
}

ProgressReport::~ProgressReport() {
    console_.clearBar();
}

void ProgressReport::update(double share) {
    const double done = std::clamp(share, 0.0, 1.0);
    const double of_command = begin_ + (std::max(stage_.end, begin_) - begin_) * done;
    switch (style_) {
        case ProgressStyle::kNone:
            return;
        case ProgressStyle::kJson:
            return json(done);
        case ProgressStyle::kPlain:
            return plain(done);
        case ProgressStyle::kAlf:
            return alf(of_command);
        case ProgressStyle::kOpenJd:
            return openJd(of_command);
        case ProgressStyle::kAuto:
            return console_.terminal() ? bar(done) : plain(done);
    }
}

void ProgressReport::status(const std::string& text) {
    if (style_ == ProgressStyle::kOpenJd) console_.machineLine("openjd_status: " + printable(text));
}

void ProgressReport::bar(double share) {
    if (shown_ && share < 1 && secondsSince(last_) < kBarSeconds) return;
    constexpr int kCells = 30;
    const int full = static_cast<int>(std::floor(share * kCells));
    const int percent = static_cast<int>(std::floor(share * 100));
    std::string text = stage_.name + " [" + std::string(static_cast<std::size_t>(full), '#') +
                       std::string(static_cast<std::size_t>(kCells - full), '.') + "] " +
                       std::to_string(percent) + " %";
    // Two seconds of experience make an estimate.
    const double spent = secondsSince(start_);
    if (share > 0 && share < 1 && spent > 2) {
        text += ", " + std::to_string(std::lround(spent / share * (1 - share))) + " s left";
    }
    console_.bar(text);
    shown_ = true;
    last_ = clock_();
}

void ProgressReport::plain(double share) {
    // What comes after the stage tells its end.
    if (share >= 1 || secondsSince(last_) < kPlainSeconds ||
        share - last_share_ < kPlainShare - 1e-9)
        return;
    const int percent = static_cast<int>(std::floor(share * 100 + 1e-9));
    console_.note(stage_.name + " " + std::to_string(percent) + " %");
    last_share_ = share;
    last_ = clock_();
}

void ProgressReport::json(double share) {
    if (shown_ && (share <= last_share_ || (share < 1 && secondsSince(last_) < kLineSeconds)))
        return;
    nlohmann::ordered_json line;
    line["stage"] = stage_.name;
    line["progress"] = share;
    line["seconds"] = std::round(secondsSince(start_) * 1e3) / 1e3;
    console_.machineLine(dumpJson(line));
    shown_ = true;
    last_share_ = share;
    last_ = clock_();
}

void ProgressReport::alf(double share) {
    const auto percent = [](double part) {
        return static_cast<int>(std::floor(part * 100 + 1e-9));
    };
    if (percent(share) <= percent(console_.reported())) return;
    console_.machineLine("ALF_PROGRESS " + std::to_string(percent(share)) + "%");
    console_.setReported(share);
}

void ProgressReport::openJd(double share) {
    const bool first = console_.reported() < 0, end = share >= 1 && console_.reported() < 1;
    const bool news = share - console_.reported() >= 1e-3 && secondsSince(last_) >= kLineSeconds;
    if (!first && !end && !news) return;
    char text[16];
    std::snprintf(text, sizeof text, "%.1f", std::floor(share * 1000 + 1e-6) / 10);
    console_.machineLine(std::string("openjd_progress: ") + text);
    console_.setReported(share);
    last_ = clock_();
}

double ProgressReport::secondsSince(std::chrono::steady_clock::time_point time) const {
    return std::chrono::duration<double>(clock_() - time).count();
}

}  // namespace peeler::cmd
