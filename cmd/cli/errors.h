// SPDX-License-Identifier: Apache-2.0
// How a wrong use is refused, and the one printer of errors: exceptions in, lines on stderr and an
// exit code out.
#pragma once

#include <functional>
#include <string>

#include "cmd/cli/console.h"
#include "core/base/error.h"

namespace peeler::cmd {

/// Throws Error (kUsage), for what is asked for and cannot be.
[[noreturn]] void refuse(const std::string& what, const std::string& where = "",
                         const std::string& hint = "");

/// Runs `work` and returns its result as the exit code. What it throws becomes lines on stderr and
/// the exit code that belongs to it: an Error its kind, std::bad_alloc 33, ReaderGone 141 (as
/// SIGPIPE would have it) without a word, anything else 1.
int runReported(Console& console, const std::function<int()>& work);

/// The exception that is being handled, as an Error. To be called in a catch block. ReaderGone is
/// thrown on.
Error currentError();

/// Reports an error, with a hint, on stderr. Returns its exit code.
int reportError(Console& console, const Error& error);

}  // namespace peeler::cmd
