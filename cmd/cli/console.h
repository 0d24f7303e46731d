// SPDX-License-Identifier: Apache-2.0
// The two streams of a command: the result on stdout, whole lines of messages on stderr.
#pragma once

#include <iosfwd>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/printable.h"

namespace peeler::cmd {

/// Every message is a line that begins with "peeler: " and a word that says what it is, printable()
/// and cut: a file name may hold anything, a line feed, too. Only a hint may have several lines,
/// each of which begins so. Belongs to one thread.
class Console {
  public:
    /// The streams must outlive the Console. `terminal`: a person reads `err`, so a bar may be
    /// drawn. `colors`: the word that says what a message is may be coloured.
    Console(std::ostream& out, std::ostream& err, bool terminal, bool colors = false);
    ~Console();
    Console(const Console&) = delete;
    Console& operator=(const Console&) = delete;

    /// Quiet leaves out notes and bars; warnings and errors stay.
    void setQuiet(bool quiet) { quiet_ = quiet; }
    void setVerbose(bool verbose) { verbose_ = verbose; }
    bool quiet() const { return quiet_; }
    bool terminal() const { return terminal_; }

    /// Writes the result that was asked for to stdout at once. Throws ReaderGone if nobody reads it
    /// any more, and Error (kOutput) if it cannot be written for another reason.
    void result(std::string_view text);

    void error(std::string_view text);
    void hint(std::string_view text);
    void warning(std::string_view text) { message("warning: ", text, "33"); }
    /// What a person may want to know and a script need not.
    void note(std::string_view text);
    /// A note about the whole run: the same text is told once.
    void noteOnce(const std::string& text) {
        if (told_.insert(text).second) note(text);
    }
    /// What is going on, which is told to those who ask for it.
    void detail(std::string_view text);
    /// Writes a line for programs to stderr as it is, even if quiet.
    void machineLine(std::string_view line);

    /// A prefix under which every error is written once more, for a scheduler; "" = it is not.
    void setFailurePrefix(std::string prefix) { failure_prefix_ = std::move(prefix); }
    /// The share of the command's work that a scheduler has been told is done, which must never
    /// fall. Below 0 if it has been told nothing.
    double reported() const { return reported_; }
    void setReported(double share) { reported_ = share; }

    /// Draws `text` over the previous bar; does nothing unless `err` is a terminal. Any message
    /// clears the bar first.
    void bar(std::string_view text);
    void clearBar();

  private:
    /// `color`: the word's, the parameter of a terminal's SGR sequence (ECMA-48, 8.3.117).
    void message(std::string_view word, std::string_view text, std::string_view color = "");
    std::string line(std::string_view word, std::string_view text, std::string_view color) const;
    void say(const std::string& text);

    std::ostream& out_;
    std::ostream& err_;
    bool terminal_, colors_;
    bool quiet_ = false, verbose_ = false;
    std::size_t bar_width_ = 0;
    std::string failure_prefix_;
    std::set<std::string> told_;  ///< notes about the whole run
    double reported_ = -1;
};

/// Thrown by Console::result: stdout is a pipe without a reader.
struct ReaderGone {};

}  // namespace peeler::cmd
