// SPDX-License-Identifier: Apache-2.0
// Frame lists on the command line.
#pragma once

#include <string_view>
#include <vector>

namespace peeler::cmd {

/// Parses a list of frames, separated by commas: numbers, and ranges "first-last" with an optional
/// step after an 'x' or a colon, e.g. "1-100x2,150,200-180". Numbers may be negative, and ranges
/// may descend. Returns the frames in the given order, without duplicates. Throws Error (kUsage) if
/// the text has another form or more than 1,000,000 frames.
std::vector<int> parseFrames(std::string_view text);

}  // namespace peeler::cmd
