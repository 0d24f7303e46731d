// SPDX-License-Identifier: Apache-2.0
// Tests console output: lines, errors, progress and results, and their streams.
#include <gtest/gtest.h>

#include <chrono>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/console.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/progress_lines.h"
#include "cmd/cli/report.h"
#include "cmd/options/capture_job.h"
#include "cmd/session/progress_report.h"
#include "formats/file/content_hash.h"

namespace peeler::cmd {
namespace {

struct Streams {
    std::ostringstream out, err;
};

/// Splits a text into lines. Expects a line feed at its end.
std::vector<std::string> lines(const std::string& text) {
    EXPECT_TRUE(text.empty() || text.back() == '\n') << text;
    std::vector<std::string> result;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        result.push_back(line);
    return result;
}

TEST(Console, WritesWholeLines) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    console.hint("one\ntwo\n");
    console.note("three");
    console.setQuiet(true);
    console.note("four");
    console.error("five");
    EXPECT_EQ(streams.err.str(),
              "peeler: hint: one\npeeler: hint: two\npeeler: three\npeeler: error: five\n");
    EXPECT_EQ(streams.out.str(), "");
}

TEST(Console, SaysWhatFollowsAMessageThatCouldNotBeWritten) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    streams.err.setstate(std::ios::badbit);
    console.note("one");
    streams.err.setstate(std::ios::badbit);
    console.machineLine("two");
    EXPECT_EQ(streams.err.str(), "peeler: one\ntwo\n");
}

TEST(Console, ShowsControlCharacters) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    console.error("a\x1b[31m\rb\x7f");
    EXPECT_EQ(streams.err.str(), "peeler: error: a\\x1b[31m\\x0db\\x7f\n");
}

TEST(Console, ColoursTheWordAloneWhereItMay) {
    Streams streams;
    Console console(streams.out, streams.err, true, true);
    console.error("e\x1b[1m");
    console.warning("w");
    console.hint("h");
    console.note("n");
    EXPECT_EQ(streams.err.str(),
              "peeler: \x1b[1;31merror: \x1b[0me\\x1b[1m\n"
              "peeler: \x1b[33mwarning: \x1b[0mw\n"
              "peeler: \x1b[36mhint: \x1b[0mh\n"
              "peeler: n\n");
}

TEST(Console, TellsDetailsToThoseWhoAsk) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    console.detail("one");
    console.setVerbose(true);
    console.detail("two");
    console.setQuiet(true);
    console.detail("three");
    EXPECT_EQ(streams.err.str(), "peeler: two\n");
}

TEST(Console, DrawsBarsOnTerminalsOnlyAndClearsThem) {
    Streams plain, terminal;
    {
        Console console(plain.out, plain.err, false);
        console.bar("half");
    }
    EXPECT_EQ(plain.err.str(), "");
    {
        Console console(terminal.out, terminal.err, true);
        console.bar("half");
        console.bar("all");
        console.warning("w");
    }
    EXPECT_EQ(terminal.err.str(), "\rhalf\rall \r   \rpeeler: warning: w\n");
}

TEST(Console, ResultThatCannotBeWrittenIsAnError) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    streams.out.setstate(std::ios::badbit);
    const int code = runReported(console, [&] {
        console.text("{}");
        return 0;
    });
    EXPECT_EQ(code, 4);
    EXPECT_TRUE(streams.err.str().starts_with("peeler: error: cannot write the result"))
        << streams.err.str();
}

TEST(Errors, SayWhatWhereAndWhatToTry) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    const int code = runReported(console, []() -> int {
        throw Error(ErrorKind::kInput, "index out of range", "/meshes/0",
                    "export it again\nor fix it");
    });
    EXPECT_EQ(code, 3);
    EXPECT_EQ(streams.err.str(),
              "peeler: error: index out of range: /meshes/0\n"
              "peeler: hint: export it again\npeeler: hint: or fix it\n");
}

TEST(Errors, HaveTheExitCodesOfTheContract) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    for (const auto& [kind, code] : {std::pair{ErrorKind::kInternal, 1},
                                     {ErrorKind::kUsage, 2},
                                     {ErrorKind::kInput, 3},
                                     {ErrorKind::kOutput, 4},
                                     {ErrorKind::kDevice, 5},
                                     {ErrorKind::kIncomplete, 6},
                                     {ErrorKind::kMemory, 33}}) {
        EXPECT_EQ(runReported(console, [k = kind]() -> int { throw Error(k, "x"); }), code);
    }
    EXPECT_EQ(runReported(console, []() -> int { throw std::bad_alloc(); }), 33);
    EXPECT_EQ(runReported(console, []() -> int { throw std::runtime_error("x"); }), 1);
    EXPECT_EQ(runReported(console, []() -> int { throw 7; }), 1);
    const std::string before = streams.err.str();
    EXPECT_EQ(runReported(console, []() -> int { throw ReaderGone{}; }), 141);
    EXPECT_EQ(runReported(console, [] { return 0; }), 0);
    EXPECT_EQ(streams.err.str(), before);
}

/// A clock that only the test advances.
struct HandClock {
    std::chrono::steady_clock::time_point now{};
    ProgressLines::Clock clock() {
        return [this] { return now; };
    }
    void pass(double seconds) {
        now += std::chrono::duration_cast<std::chrono::steady_clock::duration>(
            std::chrono::duration<double>(seconds));
    }
};

TEST(Progress, PlainIsAtMostALineASecondAndTenPercent) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    HandClock hand;
    console.setProgress(ProgressStyle::kAuto);
    console.progressLines().setClock(hand.clock());
    ProgressReport progress(console, "render");
    progress.update(0.5);  // shows nothing in the first second
    hand.pass(1.5);
    progress.update(0.05);  // shows nothing before a tenth of the stage is done
    progress.update(0.2);
    progress.update(0.9);
    hand.pass(1);
    progress.update(0.29);
    progress.update(0.3);
    EXPECT_EQ(streams.err.str(), "peeler: render 20 %\npeeler: render 30 %\n");
}

TEST(Progress, OnePlainLineForEveryTenth) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    HandClock hand;
    {
        console.setProgress(ProgressStyle::kPlain);
        console.progressLines().setClock(hand.clock());
        ProgressReport progress(console, "render");
        for (int i = 0; i <= 1000; ++i) {
            hand.pass(1);
            progress.update(i / 1000.0);
        }
    }
    EXPECT_EQ(lines(streams.err.str()).size(), 10U);
    EXPECT_EQ(lines(streams.err.str()).back(), "peeler: render 100 %");
}

/// A stage whose second half takes nine times as long as its first half. Once the slow rate is
/// known, the estimate of the time left is exact. An estimate from the mean rate would be too
/// small.
TEST(Progress, TheTimeLeftFollowsTheLatestRate) {
    Streams streams;
    Console console(streams.out, streams.err, true);
    HandClock hand;
    console.setProgress(ProgressStyle::kAuto);
    console.progressLines().setClock(hand.clock());
    ProgressReport progress(console, "check");
    for (int i = 1; i <= 10; ++i) {
        hand.pass(1);
        progress.update(0.05 * i);
    }
    EXPECT_TRUE(streams.err.str().find("50 %, 10 s left") != std::string::npos);
    for (int i = 1; i <= 81; ++i) {
        hand.pass(1);
        progress.update(0.5 + 0.5 * i / 90);
    }
    EXPECT_TRUE(streams.err.str().find("95 %, 9 s left") != std::string::npos);
}

TEST(Progress, BarIsClearedAtTheEnd) {
    Streams streams;
    Console console(streams.out, streams.err, true);
    HandClock hand;
    {
        console.setProgress(ProgressStyle::kAuto);
        console.progressLines().setClock(hand.clock());
        ProgressReport progress(console, "render");
        progress.update(0.5);
        EXPECT_NE(streams.err.str().find("[###############...............] 50 %"),
                  std::string::npos)
            << streams.err.str();
        progress.update(0.51);  // shows nothing so soon after the previous line
        EXPECT_EQ(streams.err.str().find("51"), std::string::npos);
    }
    EXPECT_EQ(streams.err.str().find('\n'), std::string::npos);
    EXPECT_EQ(streams.err.str().back(), '\r');
}

TEST(Progress, JsonLinesBeginAtZeroAndEndAtOne) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    console.setQuiet(true);  // the console prints JSON lines even with --quiet
    HandClock hand;
    {
        console.setProgress(ProgressStyle::kJson);
        console.progressLines().setClock(hand.clock());
        ProgressReport progress(console, "render");
        progress.update(0.001);
        hand.pass(0.5);
        progress.update(0.5);
        progress.update(1);
        progress.update(1);
    }
    const auto text = lines(streams.err.str());
    ASSERT_EQ(text.size(), 3U);
    double last = -1;
    for (const auto& line : text) {
        const auto json = nlohmann::json::parse(line);
        EXPECT_EQ(json.at("stage"), "render");
        EXPECT_GT(json.at("progress").get<double>(), last);
        last = json.at("progress");
    }
    EXPECT_EQ(last, 1);
}

TEST(Progress, NoneSaysNothing) {
    Streams streams;
    Console console(streams.out, streams.err, true);
    HandClock hand;
    console.setProgress(ProgressStyle::kNone);
    console.progressLines().setClock(hand.clock());
    ProgressReport progress(console, "render");
    hand.pass(10);
    progress.update(0.5);
    EXPECT_EQ(streams.err.str(), "");
}

/// Returns the progress lines for a picture that is counted, then rendered.
std::vector<std::string> toldOfTwoStages(ProgressStyle style) {
    Streams streams;
    Console console(streams.out, streams.err, true);
    console.setQuiet(true);  // the console prints progress lines even with --quiet
    HandClock hand;
    for (const Stage& stage : {Stage("count", kCountEnd), Stage("render")}) {
        console.setProgress(style);
        console.progressLines().setClock(hand.clock());
        ProgressReport progress(console, stage);
        if (stage.name == "render") progress.status("frame 3, 1 of 1");
        for (const double share : {0.1, 0.1, 0.5, 0.4, 0.999, 1.0, 1.0}) {
            hand.pass(1);
            progress.update(share);
        }
    }
    return lines(streams.err.str());
}

TEST(Progress, AlfIsWholePercentsThatGrow) {
    // The format is documented in Pixar's Tractor and parsed in CGRU's parsers/mantra.py.
    const std::regex published("ALF_PROGRESS ([0-9]{1,3})%");
    int last = -1;
    for (const std::string& line : toldOfTwoStages(ProgressStyle::kAlf)) {
        std::smatch match;
        ASSERT_TRUE(std::regex_match(line, match, published)) << line;
        EXPECT_GT(std::stoi(match[1]), last);
        last = std::stoi(match[1]);
    }
    EXPECT_EQ(last, 100);
}

TEST(Progress, OpenJdIsAShareOfAHundredThatNeverFalls) {
    // The regular expression is copied from openjd-sessions, _action_filter.py.
    const std::regex published("^openjd_(progress|status|fail): (.+)$");
    double last = 0;
    std::vector<std::string> status;
    const auto told = toldOfTwoStages(ProgressStyle::kOpenJd);
    for (const std::string& line : told) {
        std::smatch match;
        ASSERT_TRUE(std::regex_match(line, match, published)) << line;
        if (match[1] == "status") {
            status.push_back(match[2]);
            continue;
        }
        const double progress = std::stod(match[2]);
        EXPECT_GE(progress, last);
        last = progress;
    }
    EXPECT_EQ(told.back(), "openjd_progress: 100.0");
    EXPECT_EQ(status, (std::vector<std::string>{"count", "render", "frame 3, 1 of 1"}));
}

TEST(Progress, OpenJdIsToldWhyACommandFails) {
    Streams streams;
    Console console(streams.out, streams.err, false);
    console.setFailurePrefix("openjd_fail: ");
    console.error("no\nroom");
    EXPECT_EQ(lines(streams.err.str()),
              (std::vector<std::string>{"peeler: error: no\\x0aroom", "openjd_fail: no\\x0aroom"}));
}

TEST(Report, HasEveryKeyOfTheContract) {
    PictureResult result;
    result.inputs = {"in.glb"};
    result.output = "out\xff.exr";  // invalid UTF-8
    result.fragments_counted = 10;
    result.fragments_stored = 9;
    result.milliseconds["load"] = 1.23456;
    const auto json = nlohmann::json::parse(jsonText(toJson(result)));
    for (const char* key : {"input", "output", "bytes", "width", "height", "layers",
                            "fragmentsCounted", "fragmentsStored", "complete", "method", "passes",
                            "settingsHash", "renderer", "backend", "peakMemory", "milliseconds"}) {
        EXPECT_TRUE(json.contains(key)) << key;
    }
    EXPECT_EQ(json.size(), 19U);
    EXPECT_EQ(json["complete"], false);
    for (const char* stage : {"load", "context", "upload", "count", "capture", "sort", "composite",
                              "encode", "write", "total"}) {
        EXPECT_TRUE(json["milliseconds"].contains(stage)) << stage;
    }
    EXPECT_EQ(json["milliseconds"]["load"], 1.235);
}

TEST(Report, ListsSeveralFilesAndEndsWithTheTotal) {
    RunResult result;
    result.inputs = {"a.exr", "b.exr"};
    result.bytes = 12;
    result.files = {{"c.exr", 5, "layer"}, {"d.npz", 7}};
    result.milliseconds = {{"write", 1}, {"total", 3}, {"a verb's own", 2}};
    const Json json = toJson(result, {{"found", 1}});
    EXPECT_FALSE(json.contains("input"));
    EXPECT_EQ(json["inputs"], (Json{"a.exr", "b.exr"}));
    EXPECT_TRUE(json["output"].is_null()) << "there are several names";
    EXPECT_EQ(json["outputs"][0].dump(), R"({"kind":"layer","path":"c.exr","bytes":5})");
    EXPECT_EQ(json["outputs"][1].dump(), R"({"path":"d.npz","bytes":7})");
    const std::vector<std::string> keys{"inputs",     "output",       "bytes",    "outputs",
                                        "found",      "settingsHash", "renderer", "backend",
                                        "peakMemory", "milliseconds"};
    std::size_t i = 0;
    for (const auto& [key, value] : json.items())
        EXPECT_EQ(key, keys[i++]);
    EXPECT_EQ(i, keys.size());
    EXPECT_EQ(json["milliseconds"].size(), 11U);
    EXPECT_EQ(std::prev(json["milliseconds"].end()).key(), "total");
}

TEST(Report, SummaryIsOneLine) {
    PictureResult result;
    result.output = "out.exr";
    result.layers = 1;
    result.fragments_counted = result.fragments_stored = 1234567;
    result.bytes = 1'500'000;
    result.milliseconds["total"] = 812.4;
    EXPECT_EQ(summary(result), "out.exr: 1 layer, 1,234,567 fragments, 1.5 MB, 812 ms");
    result.fragments_counted = 2'000'000;
    EXPECT_EQ(summary(result),
              "out.exr: 1 layer, 1,234,567 fragments of 2,000,000, 1.5 MB, 812 ms");
    // Shows fragments per sample: 4000 / 4.
    result.fragments_counted = result.fragments_stored = 4000;
    result.counted_samples = 4;
    result.counts_visible = true;
    result.camera = "main";
    result.light = "studio light, 4 samples";
    EXPECT_EQ(summary(result),
              "out.exr: 1 layer, 1,000 visible fragments, camera main, studio light, 4 samples, "
              "1.5 MB, 812 ms");
}

TEST(Report, Numbers) {
    EXPECT_EQ(groupedText(0), "0");
    EXPECT_EQ(groupedText(999), "999");
    EXPECT_EQ(groupedText(1000), "1,000");
    EXPECT_EQ(bytesText(999), "999 B");
    EXPECT_EQ(bytesText(1000), "1.0 kB");
    EXPECT_EQ(bytesText(999'999), "1.0 MB");
    // Test vectors by the authors of FNV-1a.
    EXPECT_EQ(hashText(""), "cbf29ce484222325");
    EXPECT_EQ(hashText("foobar"), "85944171f73967e8");
}

TEST(SettingsHash, ChangesWithWhatChangesPixels) {
    const CaptureSettings capture;
    const std::string hash = settingsHash({0}, capture);
    EXPECT_EQ(hash, settingsHash({0}, capture));
    EXPECT_EQ(hash.size(), 16U);

    CaptureSettings same = capture;
    same.method = "front-to-back";
    same.memory = 1U << 30;
    EXPECT_EQ(hash, settingsHash({0}, same));

    CaptureSettings limited = capture;
    limited.max_layers = 3;
    CaptureSettings shadowed = capture, finer = capture, casters = capture;
    shadowed.shadows = finer.shadows = true;
    finer.shadow_size = 4096;
    casters.opaque_only = true;
    CaptureSettings blended = limited;
    blended.tail = Tail::kBlend;
    CaptureSettings approximate = capture;
    approximate.method = "weighted-sum";
    EXPECT_NE(hash, settingsHash({0}, approximate));
    EXPECT_NE(hash, settingsHash({1}, capture));
    const std::string animated = settingsHash({0, {0}}, capture);
    EXPECT_NE(hash, animated);
    EXPECT_NE(animated, settingsHash({0, {1}}, capture));
    EXPECT_NE(hash, settingsHash({0, {}, {"a"}}, capture));
    EXPECT_NE(settingsHash({0, {}, {}, {"a"}}, capture), settingsHash({0, {}, {"a"}}, capture));
    EXPECT_NE(hash, settingsHash({0}, limited));
    EXPECT_NE(settingsHash({0}, blended), settingsHash({0}, limited));
    EXPECT_NE(hash, settingsHash({0}, shadowed));
    EXPECT_NE(settingsHash({0}, finer), settingsHash({0}, shadowed));
    EXPECT_NE(hash, settingsHash({0}, casters));
}

}  // namespace
}  // namespace peeler::cmd
