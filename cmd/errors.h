// SPDX-License-Identifier: Apache-2.0
// The one printer of errors: exceptions in, lines on stderr and an exit code out.
#pragma once

#include <functional>

#include "cmd/console.h"

namespace peeler::cmd {

/// Runs `work` and returns its result as the exit code. What it throws becomes lines on stderr and
/// the exit code that belongs to it: an Error its kind, std::bad_alloc 33, ReaderGone 141 (as
/// SIGPIPE would have it) without a word, anything else 1.
int runReported(Console& console, const std::function<int()>& work);

}  // namespace peeler::cmd
