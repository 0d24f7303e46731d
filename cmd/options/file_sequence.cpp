// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/file_sequence.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/options/frames.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/sequence_options.h"
#include "cmd/session/progress_report.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFramesOption = "--frames";

struct SequenceOption {
    const char* name;
    const char* value_name;                  ///< nullptr for a flag
    void (*check)(const std::string& text);  ///< throws Error (kUsage) if the text is invalid
    bool together;                           ///< whether SequenceUse::kTogether has the option
    const char* help;
};
constexpr SequenceOption kSequenceOptions[] = {
    {kFramesOption, "LIST", [](const std::string& text) { parseFrames(text); }, true,
     "frames of an input with #### in its name, e.g. 1-100, 1-100x2 or 150,200-180 (default: all "
     "files that exist; @@@@ stands for the views that exist)"},
    {"--chunk", "I/N", [](const std::string& text) { parseShard(text); }, true,
     "take the I-th of N equal parts of all frames and views, from 1/N to N/N, so that N processes "
     "can share the work"},
    {"--skip-existing", nullptr, nullptr, false,
     "skip a picture whose files are newer than its inputs; options are not compared"},
    {"--keep-going", nullptr, nullptr, false,
     "continue after a picture fails; the exit code is the highest of all"},
};

/// Whether an option is for the whole sequence, not for the runs of single pictures.
bool isOfSequence(const std::string& name) {
    return name == "--json" || name == "--report" ||
           std::ranges::any_of(kSequenceOptions,
                               [&](const SequenceOption& row) { return name == row.name; });
}

/// Whether a name with placeholders stands for several files. False if a file has exactly this
/// name.
bool isSequenceName(const std::string& name) {
    return (hasFrameToken(name) || hasViewToken(name)) && !isSeen(name);
}

/// A reporter for the run of one picture. Keeps the result, and passes everything else on.
class PictureReporter final : public Reporter {
  public:
    /// Scales the progress of picture `index` to the progress of all `count` pictures.
    PictureReporter(Reporter& reporter, ProgressReport& progress, std::size_t index,
                    std::size_t count)
        : reporter_(reporter), progress_(progress), index_(index), count_(count) {}

    void failure(const Error& error) override { reporter_.failure(error); }
    void result(const Json& result) override { found = result; }
    void text(std::string_view text) override { reporter_.text(text); }
    void progress(const RunProgress& progress) override {
        progress_.update((static_cast<double>(index_) + progress.of_run) /
                         static_cast<double>(count_));
    }
    void setProgress(ProgressStyle style) override { reporter_.setProgress(style); }

    Json found;  ///< null if the picture has no result

  private:
    void message(Severity severity, const Text& text) override {
        if (!shows(severity)) return;
        switch (severity) {
            case Severity::kDetail:
                return reporter_.detail(text);
            case Severity::kNote:
                return reporter_.note(text);
            case Severity::kHint:
                return reporter_.hint(text);
            case Severity::kWarning:
                return reporter_.warning(text);
            case Severity::kError:
                return reporter_.error(text);
        }
    }

    Reporter& reporter_;
    ProgressReport& progress_;
    std::size_t index_, count_;
};

class FileSequence {
  public:
    FileSequence(const VerbOptions& verb, VerbAction (*declare)(VerbOptions&), SequenceUse use,
                 Session& session);

    int run();

  private:
    struct Input {
        std::string name;
        bool is_sequence;
        std::string of(const PictureNumber& number) const;
    };

    void choosePictures();
    void checkOutputs() const;
    std::string nameOf(const std::string& pattern, const PictureNumber& number) const;
    std::vector<std::string> inputsOf(const PictureNumber& number) const;
    std::vector<fs::path> outputsOf(const PictureNumber& number) const;
    std::vector<std::string> argumentsOf(const PictureNumber& number) const;
    std::vector<std::string> argumentsOfAll() const;
    bool isUpToDate(const PictureNumber& number) const;
    int runOne(std::vector<std::string> arguments, Reporter& reporter) const;
    void make(std::size_t index, ProgressReport& progress);
    Json numbered(const PictureNumber& number, const Json& result) const;
    int report();

    const VerbOptions& verb_;
    VerbAction (*declare_)(VerbOptions&);
    SequenceUse use_;
    Session& session_;
    Reporter& reporter_;
    ReportOptions report_;
    SequenceOptions options_;
    std::vector<Input> inputs_;
    std::vector<GivenOption> outputs_;
    std::vector<PictureNumber> pictures_;
    std::optional<SequenceResults> results_;
    int worst_ = 0;  ///< greatest exit code that a run returned
};

FileSequence::FileSequence(const VerbOptions& verb, VerbAction (*declare)(VerbOptions&),
                           SequenceUse use, Session& session)
    : verb_(verb),
      declare_(declare),
      use_(use),
      session_(session),
      reporter_(session.reporter()),
      report_(givenReportOptions(verb)) {
    report_.applyTo(reporter_);
    for (const std::string& name : verb.positionals())
        inputs_.push_back({name, isSequenceName(name)});
    options_.skip_existing = verb.given("--skip-existing");
    options_.keep_going = verb.given("--keep-going");
    if (verb.given("--chunk")) options_.chunk = parseShard(verb.value("--chunk"));
    for (const GivenOption& option : verb.givenTexts())
        if (option.is_file && option.group == "Output") outputs_.push_back(option);
}

/// Chooses the pictures: the frames in --frames or, without --frames, the existing files of the
/// first pattern.
void FileSequence::choosePictures() {
    const std::string& pattern = std::ranges::find_if(inputs_, &Input::is_sequence)->name;
    std::vector<FileNumbers> found = numbersThere(pattern);
    const std::string frames = verb_.value(kFramesOption);
    if (!frames.empty() && !hasFrameToken(pattern))
        throw Error(ErrorKind::kUsage, "the input has no frames", "--frames " + frames,
                    "put #### into the name of the input, or leave --frames out");
    if (!frames.empty()) {
        std::set<int> views;
        for (const FileNumbers& numbers : found)
            views.insert(numbers.view);
        if (views.empty()) views.insert(0);
        found.clear();
        for (const int frame : parseFrames(frames))
            for (const int view : views)
                found.push_back({frame, view});
    }
    if (found.empty())
        throw Error(ErrorKind::kInput, "no file has such a name", pattern,
                    "#### stands for the number of a frame, @@@@ for that of a view");
    const auto [first, end] = options_.chunk.value_or(Shard()).of(found.size());
    for (std::size_t i = first; i < end; ++i) {
        PictureNumber number;
        if (hasFrameToken(pattern)) number.frame = found[i].frame;
        if (hasViewToken(pattern)) number.view = found[i].view;
        pictures_.push_back(number);
    }
    results_.emplace(hasFrameToken(pattern) ? "frame" : "view", reporter_);
}

/// Throws Error (kUsage) if two pictures would have an output file in common.
void FileSequence::checkOutputs() const {
    if (options_.skip_existing && outputs_.empty())
        throw Error(ErrorKind::kUsage, "this run writes no files to skip", "--skip-existing",
                    "leave it out");
    for (const GivenOption& option : outputs_) {
        std::set<std::string> names;
        for (const PictureNumber& number : pictures_) {
            if (names.insert(nameOf(option.text, number)).second) continue;
            throw Error(ErrorKind::kUsage,
                        "at least two of the " + std::to_string(pictures_.size()) +
                            " pictures would have the same file name",
                        option.name + ' ' + option.text,
                        "put #### for the frame's number, or @@@@ for the view's, into the "
                        "file's name");
        }
    }
}

std::string FileSequence::nameOf(const std::string& pattern, const PictureNumber& number) const {
    std::string name = pattern;
    if (number.view) name = viewPath(name, *number.view);
    if (!number.frame) return name;
    return use_ == SequenceUse::kLayers ? firstFramePath(name, *number.frame)
                                        : framePath(name, *number.frame);
}

std::string FileSequence::Input::of(const PictureNumber& number) const {
    if (!is_sequence) return name;
    const std::string of_view = number.view ? viewPath(name, *number.view) : name;
    return number.frame ? framePath(of_view, *number.frame) : of_view;
}

std::vector<std::string> FileSequence::inputsOf(const PictureNumber& number) const {
    std::vector<std::string> names;
    for (const Input& input : inputs_)
        names.push_back(input.of(number));
    return names;
}

std::vector<fs::path> FileSequence::outputsOf(const PictureNumber& number) const {
    std::vector<fs::path> files;
    for (const GivenOption& option : outputs_) {
        const std::string name = nameOf(option.text, number);
        if (!hasFrameToken(name))
            files.emplace_back(name);
        else
            for (const int layer : framesThere(name))
                files.emplace_back(framePath(name, layer));
    }
    return files;
}

std::vector<std::string> FileSequence::argumentsOf(const PictureNumber& number) const {
    std::vector<std::string> arguments;
    for (const GivenOption& option : verb_.givenTexts()) {
        if (isOfSequence(option.name)) continue;
        const bool output = option.is_file && option.group == "Output";
        const std::string text = output ? nameOf(option.text, number) : option.text;
        arguments.push_back(option.name + '=' + text);
    }
    if (report_.json || report_.file) arguments.emplace_back("--json");
    arguments.emplace_back("--");
    std::ranges::move(inputsOf(number), std::back_inserter(arguments));
    return arguments;
}

/// Returns the arguments of a single run with the files of all pictures.
std::vector<std::string> FileSequence::argumentsOfAll() const {
    std::vector<std::string> arguments = argumentsOf(pictures_.front());
    for (std::size_t i = 1; i < pictures_.size(); ++i)
        for (const Input& input : inputs_)
            if (input.is_sequence) arguments.push_back(input.of(pictures_[i]));
    return arguments;
}

bool FileSequence::isUpToDate(const PictureNumber& number) const {
    std::error_code missing;
    std::optional<fs::file_time_type> newest;
    for (const std::string& input : inputsOf(number)) {
        const auto time = fs::last_write_time(input, missing);
        if (missing) return false;
        newest = std::max(newest.value_or(time), time);
    }
    const std::vector<fs::path> outputs = outputsOf(number);
    return !outputs.empty() && std::ranges::all_of(outputs, [&](const fs::path& output) {
        const auto time = fs::last_write_time(output, missing);
        return !missing && time > *newest;
    });
}

int FileSequence::runOne(std::vector<std::string> arguments, Reporter& reporter) const {
    ArgumentParser parser;
    const std::string name = verb_.verb();
    VerbOptions options = parser.addVerb(name, {});
    const VerbAction action = declare_(options);
    arguments.insert(arguments.begin(), name);
    parser.parse(arguments);
    session_.setReporter(reporter);
    struct Restored {
        Session& session;
        Reporter& reporter;
        ~Restored() { session.setReporter(reporter); }
    } const restored{session_, reporter_};
    return action(session_);
}

void FileSequence::make(std::size_t index, ProgressReport& progress) {
    const PictureNumber& number = pictures_[index];
    progress.status(number.text() + ", " + std::to_string(index + 1) + " of " +
                    std::to_string(pictures_.size()));
    if (options_.skip_existing && isUpToDate(number)) {
        PictureResult skipped;
        for (const std::string& input : inputsOf(number))
            skipped.inputs.emplace_back(input);
        skipped.setFiles(outputsOf(number).front(), outputsOf(number));
        skipped.skipped = true;
        return results_->add(numbered(number, toJson(skipped)), summary(skipped));
    }
    PictureReporter reporter(reporter_, progress, index, pictures_.size());
    worst_ = std::max(worst_, runOne(argumentsOf(number), reporter));
    results_->add(numbered(number, reporter.found), "");
}

/// Returns the result with the picture's number in front.
Json FileSequence::numbered(const PictureNumber& number, const Json& result) const {
    Json json;
    if (number.frame) json["frame"] = *number.frame;
    if (number.view) json["view"] = *number.view;
    if (!result.is_null()) json.update(result);
    return json;
}

int FileSequence::report() {
    const Json json = results_->json();
    if (report_.file) writeReport(*report_.file, json);
    if (report_.json || verb_.given("--dry-run")) reporter_.result(json);
    results_->reportFailures();
    return std::max(worst_, results_->worst());
}

int FileSequence::run() {
    choosePictures();
    if (use_ == SequenceUse::kTogether && !pictures_.empty()) {  // a chunk may be empty
        std::vector<std::string> arguments = argumentsOfAll();
        if (report_.file) arguments.insert(arguments.begin(), "--report=" + report_.file->string());
        if (report_.file && !report_.json) std::erase(arguments, "--json");
        return runOne(arguments, reporter_);
    }
    checkOutputs();
    std::vector<fs::path> files;
    for (const PictureNumber& number : pictures_) {
        std::ranges::copy(inputsOf(number), std::back_inserter(files));
        for (const GivenOption& option : outputs_)
            files.emplace_back(nameOf(option.text, number));
    }
    checkReport(report_, files);
    {
        ProgressReport progress(reporter_, verb_.verb());
        makeEach(
            0, pictures_.size(), options_, *results_, [&](std::size_t i) { return pictures_[i]; },
            [&](std::size_t i) {
                make(i, progress);
                progress.update(static_cast<double>(i + 1) / static_cast<double>(pictures_.size()));
            },
            [&](std::size_t i) {
                return fs::path(outputs_.empty() ? ""
                                                 : nameOf(outputs_.front().text, pictures_[i]));
            });
        progress.update(1);
    }
    return report();
}

/// Declares the sequence options that the verb lacks, and returns their names.
std::vector<std::string> addSequenceFileOptions(VerbOptions& verb, SequenceUse use,
                                                const std::shared_ptr<bool>& flag) {
    std::vector<std::string> added;
    for (const SequenceOption& row : kSequenceOptions) {
        if (verb.knows(row.name) || (use == SequenceUse::kTogether && !row.together)) continue;
        Option option = row.value_name ? verb.addText(row.name, row.value_name, row.check, row.help)
                                       : verb.addFlag(row.name, *flag, row.help);
        option.group("Sequences");
        added.emplace_back(row.name);
    }
    return added;
}

}  // namespace

VerbAction declareWithSequences(VerbOptions& verb, VerbAction (*declare)(VerbOptions&),
                                SequenceUse use) {
    const VerbAction action = declare(verb);
    const auto flag = std::make_shared<bool>();  // unused: FileSequence calls VerbOptions::given()
    const std::vector<std::string> added = addSequenceFileOptions(verb, use, flag);
    return [action, flag, added, verb, declare, use](Session& session) {
        if (std::ranges::any_of(verb.positionals(), isSequenceName))
            return FileSequence(verb, declare, use, session).run();
        for (const std::string& name : added)
            if (verb.given(name))
                throw Error(ErrorKind::kUsage, "the input is not a sequence", name,
                            "put #### for the frame's number, or @@@@ for the view's, into its "
                            "name");
        return action(session);
    };
}

}  // namespace peeler::cmd
