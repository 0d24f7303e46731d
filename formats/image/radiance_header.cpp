// SPDX-License-Identifier: Apache-2.0
#include "formats/image/radiance_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "formats/file/text_words.h"

namespace peeler {
namespace {

/// A resolution string like "-Y 4 +X 8", without its numbers: the axis from row to row, then the
/// axis along a row. +X points right, +Y up.
struct Resolution {
    std::string_view rows, pixels;
    int orientation;
};
constexpr Resolution kResolutions[] = {{"-Y", "+X", 1}, {"-Y", "-X", 2}, {"+Y", "-X", 3},
                                       {"+Y", "+X", 4}, {"+X", "-Y", 5}, {"-X", "-Y", 6},
                                       {"-X", "+Y", 7}, {"+X", "+Y", 8}};

/// Returns the numbers in the value of a setting.
std::vector<double> numbersIn(std::string_view value) {
    std::vector<double> numbers;
    for (std::string_view word = takeWord(value); !word.empty(); word = takeWord(value)) {
        const std::optional<double> number = numberIn<double>(word);
        if (!number) break;
        numbers.push_back(*number);
    }
    return numbers;
}

bool same(const std::vector<double>& numbers, const std::vector<double>& usual) {
    return std::ranges::equal(numbers, usual,
                              [](double a, double b) { return std::abs(a - b) < 2e-3; });
}

/// A setting, and the values for which it has no effect on the pixels.
struct RadianceSetting {
    std::string_view name;
    std::vector<std::vector<double>> neutral;
    const char* effect;
};
const std::vector<RadianceSetting>& radianceSettings() {
    static const std::vector<RadianceSetting> settings = {
        {"EXPOSURE=", {{1}}, "the numbers are not divided by it"},
        {"GAMMA=", {{1}}, "the numbers are taken as linear"},
        {"COLORCORR=", {{1, 1, 1}}, "the colours are not divided by it"},
        // Radiance's own default is also read as Rec. 709, without a warning.
        {"PRIMARIES=",
         {{0.640, 0.330, 0.290, 0.600, 0.150, 0.060, 0.3333, 0.3333},
          {0.640, 0.330, 0.300, 0.600, 0.150, 0.060, 0.3127, 0.3290}},
         "the colours are taken as those of Rec. 709"}};
    return settings;
}

void readSetting(std::string_view line, RadianceHeader& header) {
    for (const RadianceSetting& setting : radianceSettings()) {
        if (!line.starts_with(setting.name)) continue;
        const auto value = numbersIn(line.substr(setting.name.size()));
        if (std::ranges::any_of(setting.neutral,
                                [&](const auto& usual) { return same(value, usual); }))
            continue;
        header.notes.push_back("its header says " + std::string(line) + "; " + setting.effect);
    }
}

void readResolution(std::string_view line, RadianceHeader& header) {
    std::array<std::string_view, 4> words;  // such as "-Y", "4", "+X", "8"
    for (std::string_view& word : words)
        word = takeWord(line);
    for (const Resolution& row : kResolutions)
        if (row.rows == words[0] && row.pixels == words[2]) header.orientation = row.orientation;
}

}  // namespace

RadianceHeader radianceHeader(std::string_view text) {
    RadianceHeader header;
    std::string_view line;
    while (!text.empty() && !(line = takeLine(text)).empty())
        readSetting(line, header);
    readResolution(takeLine(text), header);
    return header;
}

}  // namespace peeler
