// SPDX-License-Identifier: Apache-2.0
// The names of the API that texts of core and formats mention, as options and verbs.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace peeler::cmd {

/// What core and formats call by the name that it has in the API, in backquotes, and what that is
/// on the command line.
struct ApiName {
    std::string_view name;          ///< of a field, a parameter, a function: "max_layers"
    std::string_view command_line;  ///< "--layers", "--as composite", "peeler devices"
};

std::span<const ApiName> apiNames();

/// A text of core or formats with these names as they are on the command line; others stay.
std::string inOptions(std::string_view text);

}  // namespace peeler::cmd
