// SPDX-License-Identifier: Apache-2.0
// Warnings about input files whose content peeler shows differently from what the file specifies.
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>

namespace peeler {

/// The warnings about one file, as sentences for the user: each once, and at most 100. With
/// `strict`, throws the first one as an Error instead. Not thread-safe.
class ReadWarnings {
  public:
    /// `file` is the place of warnings that have no place of their own.
    ReadWarnings(bool strict, std::string file) : strict_(strict), file_(std::move(file)) {}

    bool strict() const { return strict_; }

    /// Adds a whole sentence; it may include names from the file, unescaped. If `strict`, throws
    /// Error (kInput) with the sentence and the place in the file (a line or a JSON pointer).
    void warn(const Text& sentence, const Text& where = {});
    /// Adds the sentence. If `strict`, throws `problem`, the Error that caused the warning,
    /// instead.
    void warn(const Text& sentence, const Error& problem);

    const std::vector<Text>& sentences() const { return sentences_; }
    /// Returns the warnings since the last call.
    std::vector<Text> take() {
        return {sentences_.begin() + std::exchange(taken_, std::ssize(sentences_)),
                sentences_.end()};
    }

  private:
    void add(const Text& sentence);

    bool strict_;
    std::string file_;
    std::vector<Text> sentences_;
    std::ptrdiff_t taken_ = 0;
};

}  // namespace peeler
