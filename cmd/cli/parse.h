// SPDX-License-Identifier: Apache-2.0
// Parsers of command-line values. Results do not depend on the locale, and no parser accepts NaN.
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

/// All parsers below throw Error (kUsage) if the text does not have the expected form. The error's
/// message is this form; VerbOptions::addText() adds `where` (cmd/cli/arguments.h).

/// Parses a finite decimal number.
double parseNumber(std::string_view text);
/// Parses a finite number greater than 0.
double parsePositive(std::string_view text);
/// Parses a finite number of at least 0.
double parseAtLeastZero(std::string_view text);
/// Parses a positive number or "inf".
double parsePositiveOrInfinite(std::string_view text);

/// Parses an integer in [least, most].
std::int64_t parseInteger(std::string_view text, std::int64_t least, std::int64_t most);

/// Parses `count` numbers (2, 4, 6, 12 or 16) separated by commas. `expected` is the form that
/// errors show: "a,b,c,d".
template <std::size_t count>
std::array<double, count> parseNumbers(std::string_view text, std::string_view expected);

/// Parses "x,y,z".
glm::dvec3 parseVector(std::string_view text);

/// Parses "x,y,z"; not all three may be 0.
glm::dvec3 parseDirection(std::string_view text);

/// Parses a field of view in degrees, below 180.
double parseFov(std::string_view text);
/// Parses the field of view of a camera that may have a lens: at most 360 degrees.
double parseLensFov(std::string_view text);

/// Parses "1920x1080", "1920X1080" or "1920". Throws Error (kUsage) if a side exceeds
/// kMostPictureSide or the picture has more than kMostPixels pixels.
Size parseSize(std::string_view text);

/// Parses "x,y,w,h" in pixels: a non-empty window whose x and y are not negative.
Window parseCrop(std::string_view text);

/// Parses bytes: "8G", "512MiB", "1.5GB", "1000000". K, M, G, T and KiB, MiB, … are powers of 1024;
/// KB, MB, … are powers of 1000.
std::uint64_t parseBytes(std::string_view text);

/// Parses a colour to straight linear RGBA. Linear: "transparent", "r,g,b[,a]". In sRGB with linear
/// alpha: "#rrggbb[aa]", "#rgb[a]", and the basic colour keywords of CSS, such as "white".
std::array<float, 4> parseColor(std::string_view text);

/// Parses the number of layers to keep. "all" and "0" give 0, which means no limit.
std::uint32_t parseLayers(std::string_view text);

/// A share of a job that is divided among `count` processes.
struct Shard {
    int index = 1;  ///< from 1 to count
    int count = 1;

    /// Returns this shard's half-open range of the indices 0 to `items` − 1. The sizes of shards
    /// differ by at most one.
    std::pair<std::size_t, std::size_t> of(std::size_t items) const;
    std::string text() const { return std::to_string(index) + '/' + std::to_string(count); }
};

/// Parses "2/5". The index is from 1 to the count.
Shard parseShard(std::string_view text);

/// Returns a file name with {chunk} replaced by the shard's index, zero-padded to the digits of the
/// count: "train-07.tar" for shard 7 of 25.
std::string chunkName(std::string name, const Shard& part);

}  // namespace peeler::cmd
