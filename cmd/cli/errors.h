// SPDX-License-Identifier: Apache-2.0
// Error reporting: converts exceptions to stderr lines and exit codes.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include <peeler/error.h>
#include "cmd/session/reporter.h"

namespace peeler::cmd {

struct ExitCode {
    std::string_view code;  ///< a number, or "128 + n"
    std::string_view meaning;
};
std::span<const ExitCode> exitCodes();

/// Returns the name of an error kind: "usage", "input", "output", "device", "incomplete", "memory",
/// "internal".
std::string_view kindName(ErrorKind kind);

[[noreturn]] void refuse(const Text& what, const Text& where = {}, const Text& hint = {});

/// Runs `work` and returns the exit code: the result of `work` or, if `work` throws, an Error's
/// kind, 33 for std::bad_alloc, 141 for ReaderGone (as for SIGPIPE), and 1 for any other exception.
/// Prints exceptions other than ReaderGone on stderr. Passes on Cancelled.
int runReported(Reporter& reporter, const std::function<int()>& work);

/// Returns the current exception as an Error, with option names in its texts. Must be called in a
/// catch block. Rethrows ReaderGone and Cancelled.
Error currentError();

/// Reports an error on stderr; an error without a hint gets a default hint. Returns the exit code.
int reportError(Reporter& reporter, const Error& error);

}  // namespace peeler::cmd
