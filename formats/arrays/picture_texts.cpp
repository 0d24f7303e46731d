// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/picture_texts.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <peeler/channels.h>
#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/exr/exr_attributes.h"
#include "formats/exr/exr_header.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

constexpr const char* kDisplayWindow = "displayWindow";
constexpr const char* kDataWindow = "dataWindow";
constexpr const char* kChannelsText = "peeler:channels";
constexpr const char* kIdsText = "peeler:ids";
constexpr const char* kCarriedText = "peeler:carried";

/// Calls take(json) for a text, if present. Rethrows exceptions as Error (kInput) with the text's
/// name.
template <class Take>
void withText(const Texts& texts, const char* name, const std::string& where, Take&& take) {
    const auto found = texts.find(name);
    if (found == texts.end()) return;
    const std::string inside = where + ": " + name;
    try {
        take(parseJson(found->second, inside));
    } catch (const nlohmann::json::exception& problem) {
        throw Error(ErrorKind::kInput, "the text is invalid: " + printable(problem.what()), inside,
                    "formats/README.md, \"Pictures as arrays\", describes it");
    }
}

std::string hexOf(const std::vector<std::byte>& bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string text;
    for (const std::byte byte : bytes) {
        text += kDigits[std::to_integer<unsigned>(byte) >> 4U];
        text += kDigits[std::to_integer<unsigned>(byte) & 15U];
    }
    return text;
}

std::vector<std::byte> bytesOfHex(const std::string& text, const std::string& where) {
    std::vector<std::byte> bytes(text.size() / 2);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        unsigned byte = 0;
        const char* const digits = text.data() + 2 * i;
        const auto [end, failure] = std::from_chars(digits, digits + 2, byte, 16);
        if (failure != std::errc() || end != digits + 2)
            throw Error(ErrorKind::kInput, "the bytes of an attribute are not hexadecimal digits",
                        where);
        bytes[i] = static_cast<std::byte>(byte);
    }
    return bytes;
}

/// Returns a coordinate or size in pixels. Limits it, so that the sum of two fits into an int.
int pixelNumber(double value, const std::string& where) {
    constexpr double kMost = 1 << 28;
    if (!(std::abs(value) <= kMost))
        throw Error(ErrorKind::kInput, "the display or data window is implausible", where);
    return static_cast<int>(value);
}

}  // namespace

Texts pictureTexts(const char* kind, const Plan& plan, const Provenance& provenance,
                   const ArrayChannels& channels) {
    Texts texts;
    for (const PictureAttribute& attribute : pictureAttributes(plan, provenance))
        texts[attribute.name] = attribute.text();
    const Window& crop = plan.view.crop;
    texts[kPictureKind] = kind;
    texts[kDisplayWindow] = dumpJson(nlohmann::json{plan.view.width, plan.view.height});
    texts[kDataWindow] = dumpJson(nlohmann::json{crop.x0, crop.y0, crop.width(), crop.height()});
    nlohmann::ordered_json names = nlohmann::ordered_json::object();
    for (const auto& [array, components] : channels)
        names[array] = components;
    if (!channels.empty()) texts[kChannelsText] = dumpJson(names);
    const IdNames& ids = provenance.ids;
    if (!ids.empty()) {
        texts[kIdsText] = dumpJson(nlohmann::ordered_json{
            {"objects", ids.objects}, {"materials", ids.materials}, {"parents", ids.parents}});
    }
    nlohmann::json carried = nlohmann::json::array();
    for (const StoredAttribute& attribute : provenance.carried)
        carried.push_back({attribute.name, attribute.type, hexOf(attribute.value)});
    if (!carried.empty()) texts[kCarriedText] = dumpJson(carried);
    return texts;
}

std::pair<Window, Window> windowsIn(const Texts& texts, const std::string& where) {
    for (const char* name : {kDisplayWindow, kDataWindow})
        if (!texts.contains(name))
            throw Error(
                ErrorKind::kInput, "the window of the picture is missing", where + ": " + name,
                "give displayWindow as [width, height], dataWindow as [x, y, width, height]");
    std::array<int, 2> display{};
    std::array<int, 4> data{};
    const auto take = [&](auto& window) {
        return [&](const nlohmann::json& json) {
            const auto numbers = json.get<
                std::array<double, std::tuple_size_v<std::remove_reference_t<decltype(window)>>>>();
            std::ranges::transform(numbers, window.begin(),
                                   [&](double n) { return pixelNumber(n, where); });
        };
    };
    withText(texts, kDisplayWindow, where, take(display));
    withText(texts, kDataWindow, where, take(data));
    return {{0, 0, display[0], display[1]},
            {data[0], data[1], data[0] + data[2], data[1] + data[3]}};
}

std::vector<std::string> channelsIn(const Texts& texts, const std::string& array,
                                    const std::string& where) {
    std::vector<std::string> channels;
    for (const ChannelInfo& info : channelTable())
        if (info.name == array) channels.assign(info.components.begin(), info.components.end());
    withText(texts, kChannelsText, where, [&](const nlohmann::json& json) {
        if (json.contains(array)) channels = json.at(array).get<std::vector<std::string>>();
    });
    return channels;
}

IdNames idsIn(const Texts& texts, const std::string& where) {
    IdNames ids;
    withText(texts, kIdsText, where, [&](const nlohmann::json& json) {
        ids.objects = json.at("objects").get<std::vector<std::string>>();
        ids.materials = json.at("materials").get<std::vector<std::string>>();
        ids.parents = json.value("parents", std::vector<std::uint32_t>());
        if (!ids.parents.empty() && ids.parents.size() != ids.objects.size())
            throw Error(ErrorKind::kInput,
                        "the number of parents differs from the number of objects",
                        where + ": " + kIdsText);
    });
    return ids;
}

std::vector<StoredAttribute> carriedIn(const Texts& texts, bool camera_known,
                                       const std::string& where) {
    std::vector<StoredAttribute> carried;
    std::size_t bytes = 0;
    withText(texts, kCarriedText, where, [&](const nlohmann::json& json) {
        for (const auto& entry : json) {
            const auto [name, type, hex] = entry.get<std::array<std::string, 3>>();
            StoredAttribute attribute{name, type, bytesOfHex(hex, where + ": " + kCarriedText)};
            bytes += attribute.value.size();
            if (bytes > kMostCarried || !canCarry(attribute, camera_known))
                throw Error(ErrorKind::kInput,
                            "an attribute cannot be carried over: " + printable(name),
                            where + ": " + kCarriedText);
            carried.push_back(std::move(attribute));
        }
    });
    return carried;
}

Texts attributesIn(const Texts& texts) {
    Texts attributes = texts;
    for (const char* name : {kDisplayWindow, kDataWindow, kChannelsText, kIdsText, kCarriedText})
        attributes.erase(name);
    return attributes;
}

}  // namespace peeler
