// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/console.h"

#include <cerrno>
#include <cstring>
#include <ostream>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/cli/option_names.h"
#include "cmd/cli/report.h"
#include "core/base/printable.h"

namespace peeler::cmd {

Console::Console(std::ostream& out, std::ostream& err, bool terminal, bool colors)
    : out_(out), err_(err), terminal_(terminal), colors_(colors) {}

Console::~Console() {
    clearBar();
}

void Console::text(std::string_view text) {
    clearBar();
    errno = 0;
    out_ << text << std::flush;
    if (out_.good()) return;
    const int cause = errno;
    if (cause == EPIPE) throw ReaderGone{};
    throw Error(ErrorKind::kOutput,
                "cannot write the result" +
                    (cause != 0 ? ": " + std::string(std::strerror(cause)) : std::string()),
                "standard output");
}

void Console::sayHint(std::string_view text) {
    std::string lines;
    while (true) {
        const std::size_t end = text.find('\n');
        lines += line("hint: ", text.substr(0, end), "36");
        if (end == std::string_view::npos || end + 1 == text.size()) break;
        text.remove_prefix(end + 1);
    }
    say(lines);
}

void Console::failure(const Error& error) {
    message(Severity::kError,
            error.whatText() + (error.where().empty() ? "" : ": " + error.whereText()));
    if (!error.hint().empty()) hint(error.hintText());
}

void Console::result(const Json& result) {
    text(jsonText(result));
}

void Console::machineLine(std::string_view line) {
    clearBar();
    say(std::string(line).append("\n"));
}

void Console::bar(std::string_view text) {
    if (!terminal_ || quiet()) return;
    std::string line(1, '\r');
    line += printable(text, kMostOfLine);
    if (text.size() < bar_width_) line.append(bar_width_ - text.size(), ' ');
    bar_width_ = text.size();
    say(line);
}

void Console::clearBar() {
    if (bar_width_ == 0) return;
    std::string blank(bar_width_ + 2, ' ');
    blank.front() = blank.back() = '\r';
    say(blank);
    bar_width_ = 0;
}

void Console::message(Severity severity, const Text& said) {
    if (!shows(severity)) return;
    const std::string text = inOptions(said);
    clearBar();
    // The last arguments of line() are colours: SGR parameters (ECMA-48, 8.3.117).
    if (severity == Severity::kHint) return sayHint(text);
    if (severity == Severity::kError)
        say(line("error: ", text, "1;31"));
    else if (severity == Severity::kWarning)
        say(line("warning: ", text, "33"));
    else
        say(line("", text, ""));
    if (severity == Severity::kError && !failure_prefix_.empty())
        machineLine(failure_prefix_ + printable(text, kMostOfLine));
}

std::string Console::line(std::string_view word, std::string_view text,
                          std::string_view color) const {
    std::string shown(word);
    if (colors_ && !color.empty())
        shown = std::string("\x1b[").append(color).append("m").append(word).append("\x1b[0m");
    return "peeler: " + shown + printable(text, kMostOfLine) + '\n';
}

void Console::say(const std::string& text) {
    // Writes the text in a single call, so that lines of several processes do not mix in a log.
    err_.clear();  // an earlier write error must not suppress later messages
    err_ << text << std::flush;
}

}  // namespace peeler::cmd
