// SPDX-License-Identifier: Apache-2.0
// Options and verbs of the command line for the parameters that messages name.
#pragma once

#include <string>
#include <string_view>

#include <peeler/error.h>
#include <peeler/text.h>

namespace peeler::cmd {

/// Returns the option or verb: "--layers", "--as composite", "peeler devices".
std::string_view optionOf(Parameter parameter);

/// Returns a text with options in place of parameters.
std::string inOptions(const Text& text);
Error inOptions(const Error& error);

}  // namespace peeler::cmd
