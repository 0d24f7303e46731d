// SPDX-License-Identifier: Apache-2.0
#include "formats/file/read_warnings.h"

#include <algorithm>

#include "core/base/printable.h"

namespace peeler {

namespace {

// The maximum number of warnings, and the maximum bytes per sentence. Without limits, a hostile
// file could cause a warning per byte.
constexpr std::size_t kMost = 100, kMostOfSentence = 1000;

}  // namespace

void ReadWarnings::warn(const Text& sentence, const Text& where) {
    warn(sentence, Error(ErrorKind::kInput, sentence.withoutEnd('.'), where.empty() ? file_ : where,
                         "repair the file, or leave " + Parameter::kStrict + " out"));
}

void ReadWarnings::warn(const Text& sentence, const Error& problem) {
    if (strict_) throw Error(problem);
    add(sentence);
}

void ReadWarnings::add(const Text& sentence) {
    const Text shown = printableText(sentence, kMostOfSentence);
    if (sentences_.size() > kMost || std::ranges::find(sentences_, shown) != sentences_.end())
        return;
    sentences_.push_back(sentences_.size() < kMost ? shown
                                                   : Text("Further warnings are not shown."));
}

}  // namespace peeler
