// SPDX-License-Identifier: Apache-2.0
// The console: the result goes to stdout, messages go to stderr as whole lines.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>

#include "cmd/cli/progress_lines.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The Reporter of the command line. Every message is one line that begins with "peeler: " and the
/// severity; only a hint may have several such lines. Text is made printable() and shortened,
/// because file names may contain anything, even line feeds.
class Console final : public Reporter {
  public:
    /// The streams must outlive the Console. `terminal`: whether `err` is a terminal, on which a
    /// progress bar may be drawn. `colors`: whether the severity may be coloured.
    Console(std::ostream& out, std::ostream& err, bool terminal, bool colors = false);
    ~Console() override;

    bool terminal() const { return terminal_; }

    void failure(const Error& error) override;
    /// Writes the result to stdout immediately, formatted by jsonText(). Throws like text().
    void result(const Json& result) override;
    /// Writes the text to stdout. Throws ReaderGone if stdout is a pipe without a reader, Error
    /// (kOutput) if writing fails for another reason.
    void text(std::string_view text) override;
    /// Writes a line for programs to stderr, verbatim, even if quiet.
    void machineLine(std::string_view line);

    void beginStage(const RunProgress& progress) override { progress_.begin(progress); }
    void progress(const RunProgress& progress) override { progress_.update(progress); }
    void status(std::string_view text) override { progress_.status(text); }
    void endStage() override { clearBar(); }
    void setProgress(ProgressStyle style) override { progress_.setStyle(style); }
    ProgressLines& progressLines() { return progress_; }

    /// Sets a prefix for a scheduler. Every error is then printed a second time, as a line that
    /// begins with the prefix; "" = not printed again.
    void setFailurePrefix(std::string prefix) { failure_prefix_ = std::move(prefix); }

    /// Draws `text` as a progress bar over the previous bar. Does nothing unless `err` is a
    /// terminal. Any message clears the bar first.
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

/// Thrown by Console::text() if stdout is a pipe without a reader.
struct ReaderGone {};

}  // namespace peeler::cmd
