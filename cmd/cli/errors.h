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

/// A row of the exit-code table.
struct ExitCode {
    std::string_view code;  ///< a number, or "128 + n"
    std::string_view meaning;
};
std::span<const ExitCode> exitCodes();

/// Returns the name of an error kind: "usage", "input", "output", "device", "incomplete", "memory",
/// "internal".
std::string_view kindName(ErrorKind kind);

/// Throws Error (kUsage).
[[noreturn]] void refuse(const Text& what, const Text& where = {}, const Text& hint = {});

/// Runs `work` and returns its result as the exit code. Prints exceptions on stderr and returns
/// their exit code: an Error's kind, 33 for std::bad_alloc, 141 for ReaderGone (as for SIGPIPE;
/// prints nothing), 1 for anything else.
int runReported(Reporter& reporter, const std::function<int()>& work);

/// Returns the exception being handled as an Error that names options. Must be called in a catch
/// block. Rethrows ReaderGone.
Error currentError();

/// Reports an error, with a hint, on stderr. Returns its exit code.
int reportError(Reporter& reporter, const Error& error);

}  // namespace peeler::cmd
