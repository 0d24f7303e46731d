// SPDX-License-Identifier: Apache-2.0
// Parsers of command-line values. Independent of the locale; NaN is never accepted.
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

/// All parsers below throw Error (kUsage) with the expected form. The caller adds `where`, which
/// VerbOptions::addText() does (cmd/cli/arguments.h).

/// Parses a finite decimal number.
double parseNumber(std::string_view text);
/// Parses a finite number greater than 0.
double parsePositive(std::string_view text);
/// Parses a positive number or "inf".
double parsePositiveOrInfinite(std::string_view text);

/// Parses an integer in [least, most].
std::int64_t parseInteger(std::string_view text, std::int64_t least, std::int64_t most);

/// Parses `count` numbers (2, 4, 6, 12 or 16) separated by commas; `expected` is the form in the
/// error: "a,b,c,d".
template <std::size_t count>
std::array<double, count> parseNumbers(std::string_view text, std::string_view expected);

/// Parses "x,y,z".
glm::dvec3 parseVector(std::string_view text);

/// Parses "x,y,z", not all 0.
glm::dvec3 parseDirection(std::string_view text);

/// Parses a field of view in degrees, between 0 and 180.
double parseFov(std::string_view text);

/// Limits of a picture's side and pixels. GL and common EXR readers support this side; a pixel
/// index fits 32 bits with room to spare. Parses "1920x1080" or "1920".
Size parseSize(std::string_view text);

/// Parses "x,y,w,h" in pixels: a non-empty window with x and y of at least 0.
Window parseCrop(std::string_view text);

/// Parses bytes: "8G", "512MiB", "1.5GB", "1000000". K, M, G, T and KiB, MiB, … are powers of 1024;
/// KB, MB, … are powers of 1000.
std::uint64_t parseBytes(std::string_view text);

/// Parses straight linear RGBA: "transparent", "r,g,b[,a]" (linear) or "#rrggbb[aa]" (sRGB, alpha
/// linear).
std::array<float, 4> parseColor(std::string_view text);

/// Parses the number of layers to keep: "all" and "0" give 0, no limit; else 1 or more.
std::uint32_t parseLayers(std::string_view text);

/// One of `count` parts of work divided among processes.
struct Shard {
    int index = 1;  ///< from 1 to count
    int count = 1;

    /// Returns this shard's half-open range of `items` items. The shards partition the items in
    /// order; sizes differ by at most one.
    std::pair<std::size_t, std::size_t> of(std::size_t items) const;
    std::string text() const { return std::to_string(index) + '/' + std::to_string(count); }
};

/// Parses "2/5", from 1/N to N/N.
Shard parseShard(std::string_view text);

/// Returns a file name with {chunk} replaced by the part's number, padded to the digits of `count`:
/// "train-07.tar" for part 7 of 25.
std::string chunkName(std::string name, const Shard& part);

}  // namespace peeler::cmd
