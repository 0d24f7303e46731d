// SPDX-License-Identifier: Apache-2.0
// Lists of frames on the command line.
#pragma once

#include <string_view>
#include <vector>

namespace peeler::cmd {

/// Frames in the order in which they are given, each once: numbers and ranges "first-last" with an
/// optional step after an 'x' or a colon, separated by commas, e.g. "1-100x2,150,200-180". Numbers
/// may be negative, ranges may fall. Throws Error (kUsage) for anything else, and for more than
/// 1,000,000 frames.
std::vector<int> parseFrames(std::string_view text);

}  // namespace peeler::cmd
