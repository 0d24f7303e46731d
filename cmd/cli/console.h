// SPDX-License-Identifier: Apache-2.0
// The two streams of a command: the result on stdout, whole lines of messages on stderr.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>

#include "cmd/cli/progress_lines.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The Reporter of the command line. Every message is a line that begins with "peeler: " and a word
/// for its severity, printable() and cut: a file name may hold anything, a line feed, too. Only a
/// hint may have several lines, each of which begins so.
class Console final : public Reporter {
  public:
    /// The streams must outlive the Console. `terminal`: a person reads `err`, so a bar may be
    /// drawn. `colors`: the word for the severity may be coloured.
    Console(std::ostream& out, std::ostream& err, bool terminal, bool colors = false);
    ~Console() override;

    bool terminal() const { return terminal_; }

    /// An error and a hint, on stderr.
    void failure(const Error& error) override;
    /// Writes the result to stdout at once, as jsonText(). Throws like text().
    void result(const Json& result) override;
    /// Throws ReaderGone if nobody reads stdout any more, and Error (kOutput) if it cannot be
    /// written for another reason.
    void text(std::string_view text) override;
    /// Writes a line for programs to stderr as it is, even if quiet.
    void machineLine(std::string_view line);

    void beginStage(const RunProgress& progress) override { progress_.begin(progress); }
    void progress(const RunProgress& progress) override { progress_.update(progress); }
    void status(std::string_view text) override { progress_.status(text); }
    void endStage() override { clearBar(); }
    void setProgress(ProgressStyle style) override { progress_.setStyle(style); }
    ProgressLines& progressLines() { return progress_; }

    /// A prefix under which every error is written once more, for a scheduler; "" = it is not.
    void setFailurePrefix(std::string prefix) { failure_prefix_ = std::move(prefix); }

    /// Draws `text` over the previous bar; does nothing unless `err` is a terminal. Any message
    /// clears the bar first.
    void bar(std::string_view text);
    void clearBar();

  private:
    void message(Severity severity, const Text& text) override;
    void sayHint(std::string_view text);
    std::string line(std::string_view word, std::string_view text, std::string_view color) const;
    void say(const std::string& text);

    std::ostream& out_;
    std::ostream& err_;
    bool terminal_, colors_;
    std::size_t bar_width_ = 0;
    std::string failure_prefix_;
    ProgressLines progress_{*this};
};

/// Thrown by Console::text: stdout is a pipe without a reader.
struct ReaderGone {};

}  // namespace peeler::cmd
