// SPDX-License-Identifier: Apache-2.0
// Numbers of frames, and the names of their files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace peeler::cmd {

/// Frames in the order in which they are given, each once: numbers and ranges "first-last" with an
/// optional step after an 'x' or a colon, separated by commas, e.g. "1-100x2,150,200-180". Numbers
/// may be negative, ranges may fall. Throws Error (kUsage) for anything else, and for more than
/// 1,000,000 frames.
std::vector<int> parseFrames(std::string_view text);

/// Whether a file name has a place for the frame's number: "####" or "%04d".
bool hasFrameToken(const std::string& path);

/// The name with the frame's number in it: so many digits as there are '#' (a lone one stands for
/// four), or as printf does for "%04d" and "%d"; "%%" is a '%'. A sign comes before the digits.
/// Tokens count in the last component of the path only.
std::string framePath(const std::string& path, int frame);

}  // namespace peeler::cmd
