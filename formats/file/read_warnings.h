// SPDX-License-Identifier: Apache-2.0
// Warnings about content of input files that peeler ignores or cannot show as specified.
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>

namespace peeler {

/// The warnings about one file, as sentences for the user: each once, and at most 100. If `strict`,
/// throws the first warning as an Error instead. Not thread-safe.
class ReadWarnings {
  public:
    /// `file` is the place given to warnings without `where`.
    ReadWarnings(bool strict, std::string file) : strict_(strict), file_(std::move(file)) {}

    bool strict() const { return strict_; }

    /// Adds a whole sentence, which may include unescaped names from the file. If `strict`, throws
    /// Error (kInput) with the sentence and the place in the file (a line or a JSON pointer)
    /// instead.
    void warn(const Text& sentence, const Text& where = {});
    /// Adds the sentence. If `strict`, throws `problem`, the cause of the warning, instead.
    void warn(const Text& sentence, const Error& problem);

    const std::vector<Text>& sentences() const { return sentences_; }
    /// Returns the warnings added since the last call.
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
