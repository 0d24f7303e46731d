// SPDX-License-Identifier: Apache-2.0
// The options and verbs of the command line that correspond to the parameters in messages.
#pragma once

#include <string>
#include <string_view>

#include <peeler/error.h>
#include <peeler/text.h>

namespace peeler::cmd {

/// Returns the option or verb for a parameter: "--layers", "--as composite", "peeler devices".
std::string_view optionOf(Parameter parameter);

/// Returns the text or error with every parameter replaced by its option or verb.
std::string inOptions(const Text& text);
Error inOptions(const Error& error);

}  // namespace peeler::cmd
