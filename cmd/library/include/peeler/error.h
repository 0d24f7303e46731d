// SPDX-License-Identifier: Apache-2.0
// The only error type: kind, message, place and hint.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The cause of a failure. The values are the exit codes of the command line.
enum class ErrorKind : int {
    kInternal = 1,    ///< a bug in peeler: an invariant did not hold
    kUsage = 2,       ///< the caller requested something invalid or nonexistent
    kInput = 3,       ///< an input file is unreadable or invalid
    kOutput = 4,      ///< an output could not be written
    kDevice = 5,      ///< no usable GL device was found, or the device was lost
    kIncomplete = 6,  ///< fragments were dropped, but the caller requires all of them
    kMemory = 33,     ///< out of memory, or over the budget
};

/// Thrown by every part of peeler. `what` is a sentence without a full stop; `where` is a path, a
/// JSON pointer into the glTF ("/meshes/0/primitives/1"), a part name, or empty; `hint` is a
/// suggestion, or empty. All three may contain names from files verbatim. A text is cut after 8,000
/// bytes and then ends in "…".
class Error : public std::runtime_error {
  public:
    Error(ErrorKind kind, Text what, Text where = {}, Text hint = {});

    ErrorKind kind() const noexcept { return kind_; }
    const std::string& where() const noexcept { return where_.str(); }
    const std::string& hint() const noexcept { return hint_.str(); }

    /// Return the texts with Parameter values in them, so that programs can substitute their own
    /// names for the parameters.
    const Text& whatText() const noexcept { return what_; }
    const Text& whereText() const noexcept { return where_; }
    const Text& hintText() const noexcept { return hint_; }

    Error at(Text where) const { return {kind_, what_, std::move(where), hint_}; }

  private:
    ErrorKind kind_;
    Text what_, where_, hint_;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
