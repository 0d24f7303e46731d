// SPDX-License-Identifier: Apache-2.0
// The one printer of errors: exceptions in, lines on stderr and an exit code out.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include <peeler/error.h>
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// A row of the table of exit codes.
struct ExitCode {
    std::string_view code;  ///< a number, or "128 + n"
    std::string_view meaning;
};
std::span<const ExitCode> exitCodes();

/// The name of a kind of error: "usage", "input", "output", "device", "incomplete", "memory",
/// "internal".
std::string_view kindName(ErrorKind kind);

/// Throws Error (kUsage), for what is asked for and cannot be.
[[noreturn]] void refuse(const Text& what, const Text& where = {}, const Text& hint = {});

/// Runs `work` and returns its result as the exit code. What it throws becomes lines on stderr and
/// the exit code that belongs to it: an Error its kind, std::bad_alloc 33, ReaderGone 141 (as
/// SIGPIPE would have it) without a word, anything else 1.
int runReported(Reporter& reporter, const std::function<int()>& work);

/// The exception that is being handled, as an Error that names options. To be called in a catch
/// block. ReaderGone is thrown on.
Error currentError();

/// Reports an error, with a hint, on stderr. Returns its exit code.
int reportError(Reporter& reporter, const Error& error);

}  // namespace peeler::cmd
