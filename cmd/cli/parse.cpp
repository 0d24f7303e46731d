// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/parse.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "core/base/color.h"
#include "core/scene/camera_choice.h"

namespace peeler::cmd {

namespace {

/// Parses the whole text as a T. Returns nothing if the text has another form.
template <class T>
std::optional<T> readAll(std::string_view text) {
    // Skips a plus sign, because from_chars accepts only a minus sign.
    if (text.starts_with('+')) {
        text.remove_prefix(1);
        if (text.starts_with('-')) return std::nullopt;
    }
    T value{};
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    while (true) {
        const std::size_t end = text.find(separator);
        parts.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

float decodeSrgb(int byte) {
    return static_cast<float>(linearFromSrgb(byte / 255.0));
}

std::array<float, 4> parseHexColor(std::string_view text) {
    constexpr const char* kExpected =
        "expected #rgb, #rgba, #rrggbb or #rrggbbaa with hexadecimal digits";
    std::string digits(text);
    if (digits.size() == 3 || digits.size() == 4) {  // each digit is doubled
        for (std::size_t i = text.size(); i-- > 0;)
            digits.insert(i, 1, text[i]);
    }
    if (digits.size() != 6 && digits.size() != 8) refuse(kExpected);
    std::array<int, 4> bytes{0, 0, 0, 255};
    for (std::size_t i = 0; i < digits.size() / 2; ++i) {
        const std::string_view pair = std::string_view(digits).substr(2 * i, 2);
        const auto [end, failure] = std::from_chars(pair.data(), pair.data() + 2, bytes[i], 16);
        if (failure != std::errc() || end != pair.data() + 2 || bytes[i] < 0) refuse(kExpected);
    }
    return {decodeSrgb(bytes[0]), decodeSrgb(bytes[1]), decodeSrgb(bytes[2]),
            static_cast<float>(bytes[3]) / 255.0F};
}

/// The basic colour keywords of CSS Color Module Level 3, section 4.1.
struct NamedColor {
    std::string_view name, digits;
};
constexpr NamedColor kNamedColors[] = {
    {"black", "000000"},  {"silver", "c0c0c0"}, {"gray", "808080"},   {"white", "ffffff"},
    {"maroon", "800000"}, {"red", "ff0000"},    {"purple", "800080"}, {"fuchsia", "ff00ff"},
    {"green", "008000"},  {"lime", "00ff00"},   {"olive", "808000"},  {"yellow", "ffff00"},
    {"navy", "000080"},   {"blue", "0000ff"},   {"teal", "008080"},   {"aqua", "00ffff"},
    {"grey", "808080"},
};

struct SizeUnit {
    std::string_view suffix;
    double bytes;
};
constexpr double kSizeStep = 1024;
constexpr SizeUnit kSizeUnits[] = {
    {"", 1},
    {"B", 1},
    {"K", kSizeStep},
    {"KiB", kSizeStep},
    {"KB", 1e3},
    {"M", kSizeStep* kSizeStep},
    {"MiB", kSizeStep* kSizeStep},
    {"MB", 1e6},
    {"G", kSizeStep* kSizeStep* kSizeStep},
    {"GiB", kSizeStep* kSizeStep* kSizeStep},
    {"GB", 1e9},
    {"T", kSizeStep* kSizeStep* kSizeStep* kSizeStep},
    {"TiB", kSizeStep* kSizeStep* kSizeStep* kSizeStep},
    {"TB", 1e12},
};

bool equalIgnoringCase(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const auto lower = [](char c) {
            return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
        };
        if (lower(a[i]) != lower(b[i])) return false;
    }
    return true;
}

}  // namespace

double parseNumber(std::string_view text) {
    const auto value = readAll<double>(text);
    if (!value || !std::isfinite(*value)) refuse("expected a finite number");
    return *value;
}

double parsePositive(std::string_view text) {
    const double value = parseNumber(text);
    if (value <= 0) refuse("expected a number greater than 0");
    return value;
}

double parseAtLeastZero(std::string_view text) {
    const double value = parseNumber(text);
    if (value < 0) refuse("expected a number of at least 0");
    return value;
}

double parsePositiveOrInfinite(std::string_view text) {
    return text == "inf" ? std::numeric_limits<double>::infinity() : parsePositive(text);
}

std::int64_t parseInteger(std::string_view text, std::int64_t least, std::int64_t most) {
    const auto value = readAll<std::int64_t>(text);
    if (!value || *value < least || *value > most) {
        refuse("expected a whole number from " + std::to_string(least) + " to " +
               std::to_string(most));
    }
    return *value;
}

template <std::size_t count>
std::array<double, count> parseNumbers(std::string_view text, std::string_view expected) {
    const auto parts = split(text, ',');
    if (parts.size() != count) {
        refuse("expected " + std::to_string(count) + " numbers " + std::string(expected));
    }
    std::array<double, count> numbers{};
    for (std::size_t i = 0; i < count; ++i)
        numbers[i] = parseNumber(parts[i]);
    return numbers;
}
template std::array<double, 2> parseNumbers<2>(std::string_view, std::string_view);
template std::array<double, 4> parseNumbers<4>(std::string_view, std::string_view);
template std::array<double, 6> parseNumbers<6>(std::string_view, std::string_view);
template std::array<double, 12> parseNumbers<12>(std::string_view, std::string_view);
template std::array<double, 16> parseNumbers<16>(std::string_view, std::string_view);

glm::dvec3 parseVector(std::string_view text) {
    const auto parts = split(text, ',');
    if (parts.size() != 3) refuse("expected three numbers x,y,z");
    return {parseNumber(parts[0]), parseNumber(parts[1]), parseNumber(parts[2])};
}

glm::dvec3 parseDirection(std::string_view text) {
    const glm::dvec3 direction = parseVector(text);
    if (direction == glm::dvec3(0)) {
        throw Error(ErrorKind::kUsage, "expected a direction with a length greater than 0");
    }
    return direction;
}

double parseFov(std::string_view text) {
    const double degrees = parseNumber(text);
    if (!(degrees > 0 && degrees < 180)) {
        throw Error(ErrorKind::kUsage, "expected an angle between 0 and 180 degrees");
    }
    return degrees;
}

double parseLensFov(std::string_view text) {
    const double degrees = parseNumber(text);
    if (!(degrees > 0 && degrees <= 360))
        throw Error(ErrorKind::kUsage, "expected an angle of at most 360 degrees");
    return degrees;
}

Size parseSize(std::string_view text) {
    std::string lower(text);
    std::ranges::replace(lower, 'X', 'x');
    const auto parts = split(lower, 'x');
    const auto is_number = [](std::string_view part) { return readAll<double>(part).has_value(); };
    if (parts.size() > 2 || !std::ranges::all_of(parts, is_number))
        refuse("expected WIDTHxHEIGHT or WIDTH in pixels, such as 1280x720 or 1280");
    Size size;
    size.width = static_cast<int>(parseInteger(parts[0], 1, kMostPictureSide));
    if (parts.size() == 2)
        size.height = static_cast<int>(parseInteger(parts[1], 1, kMostPictureSide));
    checkPixels(size);
    return size;
}

Window parseCrop(std::string_view text) {
    const auto parts = split(text, ',');
    if (parts.size() != 4) refuse("expected four whole numbers x,y,width,height");
    const auto value = [&](std::size_t i) {
        return static_cast<int>(parseInteger(parts[i], i < 2 ? 0 : 1, kMostPictureSide));
    };
    const int x = value(0), y = value(1);
    return {x, y, x + value(2), y + value(3)};
}

std::uint64_t parseBytes(std::string_view text) {
    const std::size_t end = text.find_last_of("0123456789.");
    const std::size_t digits = end == std::string_view::npos ? 0 : end + 1;
    const auto number = readAll<double>(text.substr(0, digits));
    for (const SizeUnit& unit : kSizeUnits) {
        if (!number || !equalIgnoringCase(text.substr(digits), unit.suffix)) continue;
        const double bytes = *number * unit.bytes;
        // The limit is 2^60: more than any machine has, and exact in every type used here.
        if (!(bytes >= 1 && bytes <= 0x1p60))
            refuse("expected an amount of memory from 1 byte to 1024 PiB");
        return static_cast<std::uint64_t>(bytes);
    }
    refuse("expected an amount of memory such as 8G, 512MiB or 2000000000");
}

std::array<float, 4> parseColor(std::string_view text) {
    if (text == "transparent") return {0, 0, 0, 0};
    if (text.starts_with('#')) return parseHexColor(text.substr(1));
    for (const NamedColor& color : kNamedColors)
        if (equalIgnoringCase(text, color.name)) return parseHexColor(color.digits);
    const auto parts = split(text, ',');
    if (parts.size() != 3 && parts.size() != 4) {
        refuse(
            "expected a basic colour of CSS such as white, transparent, #rrggbb[aa] or #rgb[a] "
            "(sRGB), or r,g,b[,a] (linear)");
    }
    std::array<float, 4> color{0, 0, 0, 1};
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const double value = parseNumber(parts[i]);
        // Colours may be brighter than white, up to 65504, the largest half.
        if (value < 0 || value > (i == 3 ? 1.0 : 65504.0)) {
            refuse(i == 3 ? "alpha must be from 0 to 1" : "a colour must be from 0 to 65504");
        }
        color[i] = static_cast<float>(value);
    }
    return color;
}

std::uint32_t parseLayers(std::string_view text) {
    if (text == "all") return 0;
    const auto value = readAll<std::int64_t>(text);
    if (!value || *value < 0 || *value > std::numeric_limits<std::int32_t>::max()) {
        refuse("expected all (or 0), or a number of layers, 1 or more");
    }
    return static_cast<std::uint32_t>(*value);
}

std::pair<std::size_t, std::size_t> Shard::of(std::size_t items) const {
    const auto i = static_cast<std::size_t>(index), n = static_cast<std::size_t>(count);
    return {items * (i - 1) / n, items * i / n};
}

Shard parseShard(std::string_view text) {
    constexpr int kMost = 1000000;
    const std::size_t slash = text.find('/');
    try {
        if (slash == std::string_view::npos) throw Error(ErrorKind::kUsage, "no slash");
        Shard shard;
        shard.count = static_cast<int>(parseInteger(text.substr(slash + 1), 1, kMost));
        shard.index = static_cast<int>(parseInteger(text.substr(0, slash), 1, shard.count));
        return shard;
    } catch (const Error&) {
        throw Error(ErrorKind::kUsage, "expected a part from 1/N to N/N", "",
                    "e.g. 1/4 for the first of four");
    }
}

std::string chunkName(std::string name, const Shard& part) {
    constexpr std::string_view kPlace = "{chunk}";
    std::string number = std::to_string(part.index);
    number.insert(0, std::to_string(part.count).size() - number.size(), '0');
    for (std::size_t at = name.find(kPlace); at != std::string::npos;
         at = name.find(kPlace, at + number.size()))
        name.replace(at, kPlace.size(), number);
    return name;
}

}  // namespace peeler::cmd
