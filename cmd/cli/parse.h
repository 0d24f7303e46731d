// SPDX-License-Identifier: Apache-2.0
// Values on the command line, from text. Independent of the locale; NaN is never a value.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <utility>

#include <peeler/camera_choice.h>
#include <peeler/window.h>

namespace peeler::cmd {

/// All readers below throw Error (kUsage) that says what is expected. Its `where` is the caller's
/// to add, which VerbOptions::addText() does (cmd/cli/arguments.h).

/// A finite decimal number.
double parseNumber(std::string_view text);
/// A finite number greater than 0.
double parsePositive(std::string_view text);
/// A positive number, or "inf".
double parsePositiveOrInfinite(std::string_view text);

/// A whole number in [least, most].
std::int64_t parseInteger(std::string_view text, std::int64_t least, std::int64_t most);

/// `count` numbers (2, 4, 6, 12 or 16) with commas between; `expected` shows them: "a,b,c,d".
template <std::size_t count>
std::array<double, count> parseNumbers(std::string_view text, std::string_view expected);

/// "x,y,z".
glm::dvec3 parseVector(std::string_view text);

/// "x,y,z", not all of them 0.
glm::dvec3 parseDirection(std::string_view text);

/// A field of view in degrees, between 0 and 180.
double parseFov(std::string_view text);

/// Sides and pixels of the largest picture. The side is what the GL and EXR readers in use take,
/// the pixels are where a picture's index still fits 32 bits with room to spare.
/// "1920x1080" or "1920".
Size parseSize(std::string_view text);

/// "x,y,w,h" in pixels, whose window is not empty and begins at (0, 0) or beyond.
Window parseCrop(std::string_view text);

/// Bytes: "8G", "512MiB", "1.5GB", "1000000". K, M, G, T and KiB, MiB, … are powers of 1024; KB,
/// MB, … are powers of 1000.
std::uint64_t parseBytes(std::string_view text);

/// Straight linear RGBA: "transparent", "r,g,b[,a]" (linear) or "#rrggbb[aa]" (sRGB, alpha linear).
std::array<float, 4> parseColor(std::string_view text);

/// Layers to keep: "all" and "0" are 0, no limit; else 1 or more.
std::uint32_t parseLayers(std::string_view text);

/// One of `count` parts, for work that several processes divide among themselves.
struct Shard {
    int index = 1;  ///< from 1 to count
    int count = 1;

    /// The half-open range of `items` things that is this shard: all shards together have each
    /// once, in order, and differ by one in size at most.
    std::pair<std::size_t, std::size_t> of(std::size_t items) const;
    std::string text() const { return std::to_string(index) + '/' + std::to_string(count); }
};

/// "2/5", from 1/N to N/N.
Shard parseShard(std::string_view text);

/// A file's name with the number of the part in place of {chunk}, with as many digits as the
/// greatest has: "train-07.tar" of the seventh of 25.
std::string chunkName(std::string name, const Shard& part);

}  // namespace peeler::cmd
