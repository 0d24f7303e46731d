// SPDX-License-Identifier: Apache-2.0
// Warnings about content of an input file that is not shown as the file says.
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>

namespace peeler {

/// The warnings of one file, for people: each sentence once, at most 100 of them. With `strict` the
/// first one is an Error instead. Belongs to one thread.
class ReadWarnings {
  public:
    /// `file` is where a warning is from that names no place.
    ReadWarnings(bool strict, std::string file) : strict_(strict), file_(std::move(file)) {}

    bool strict() const { return strict_; }

    /// Adds a whole sentence; names of the file may stand in it as they are. Throws Error (kInput)
    /// with the sentence and the place, a line or a JSON pointer, if `strict`.
    void warn(const Text& sentence, const Text& where = {});
    /// Adds the sentence. Throws `problem`, its cause, if `strict`.
    void warn(const Text& sentence, const Error& problem);

    const std::vector<Text>& sentences() const { return sentences_; }
    /// Those that have come since it was last called.
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
