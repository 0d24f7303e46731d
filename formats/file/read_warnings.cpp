// SPDX-License-Identifier: Apache-2.0
#include "formats/file/read_warnings.h"

#include <algorithm>

#include "core/base/printable.h"

namespace peeler {

namespace {

// A hostile file could cause one warning for each of its bytes.
constexpr std::size_t kMost = 100, kMostOfSentence = 1000;

}  // namespace

void ReadWarnings::warn(const std::string& sentence, const std::string& where) {
    std::string what = sentence;
    if (what.ends_with('.')) what.pop_back();
    warn(sentence, Error(ErrorKind::kInput, what, where.empty() ? file_ : where,
                         "mend the file, or leave `strict` out"));
}

void ReadWarnings::warn(const std::string& sentence, const Error& problem) {
    if (strict_) throw Error(problem);
    add(sentence);
}

void ReadWarnings::add(const std::string& sentence) {
    const std::string shown = printable(sentence, kMostOfSentence);
    if (sentences_.size() > kMost || std::ranges::find(sentences_, shown) != sentences_.end())
        return;
    sentences_.push_back(sentences_.size() < kMost ? shown
                                                   : "There are more warnings than fit here.");
}

}  // namespace peeler
