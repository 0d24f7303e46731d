// SPDX-License-Identifier: Apache-2.0
// The one error type: kind, message, place and hint.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The cause of a failure. The values are the exit codes of the command line.
enum class ErrorKind : int {
    kInternal = 1,    ///< a bug of ours: an invariant did not hold
    kUsage = 2,       ///< the caller asks for something that does not exist
    kInput = 3,       ///< an input file is unreadable or invalid
    kOutput = 4,      ///< an output could not be written
    kDevice = 5,      ///< no usable GL device, or it was lost
    kIncomplete = 6,  ///< fragments were left out and the caller forbids that
    kMemory = 33,     ///< out of memory, or over the budget
};

/// Thrown by every layer. `what` is a sentence without a full stop; `where` is a path, a JSON
/// pointer into the glTF ("/meshes/0/primitives/1"), a part name, or empty; `hint` says what to
/// try, or is empty. Names from files stand in them as they are, but none makes them endless: after
/// 8,000 bytes "…" stands for the rest.
class Error : public std::runtime_error {
  public:
    Error(ErrorKind kind, std::string what, std::string where = {}, std::string hint = {})
        : std::runtime_error(cut(std::move(what))),
          kind_(kind),
          where_(cut(std::move(where))),
          hint_(cut(std::move(hint))) {}

    ErrorKind kind() const noexcept { return kind_; }
    const std::string& where() const noexcept { return where_; }
    const std::string& hint() const noexcept { return hint_; }

  private:
    static std::string cut(std::string text) {
        std::size_t end = 8000;
        if (text.size() <= end) return text;
        while (end > 0 && (text[end] & 0xC0) == 0x80)
            --end;  // not within a character of UTF-8
        return text.replace(end, std::string::npos, "…");
    }

    ErrorKind kind_;
    std::string where_;
    std::string hint_;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
