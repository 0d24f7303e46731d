// SPDX-License-Identifier: Apache-2.0
#include "formats/file/json_text.h"

#include <nlohmann/json.hpp>
#include <utility>

#include <peeler/error.h>
#include "core/base/printable.h"

namespace peeler {
namespace {

// The maximum nesting depth, because parsers and destructors of JSON values recurse. Among real
// files, glTF extras are nested most deeply.
constexpr int kMaxJsonDepth = 200;

constexpr std::size_t kMostOfProblem = 300;  ///< maximum bytes of the parser's message

template <class Json>
Json parsed(std::string_view text, const std::string& where) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);  // a byte order mark
    checkJsonDepth(text, where);
    try {
        return Json::parse(text.begin(), text.end());
    } catch (const nlohmann::json::exception& problem) {
        // The message reads "[json.exception.parse_error.101] parse error at line 3, column 7: …;
        // last read: '…'". The part after "last read" may be the whole file.
        std::string_view what = problem.what();
        if (const std::size_t end = what.find("] "); end != std::string_view::npos)
            what.remove_prefix(end + 2);
        throw Error(ErrorKind::kInput,
                    "the file is not valid JSON: " + printable(what, kMostOfProblem), where,
                    "copy or export the file again");
    }
}

template <class Json>
Json parsedOrNull(std::string_view text) {
    try {
        return parsed<Json>(text, "");
    } catch (const Error&) {
        return {};
    }
}

/// Returns the text with \xNN in place of each non-UTF-8 byte.
std::string asUtf8(std::string_view text) {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = utf8Length(text.substr(i));
        if (length == 0)
            result += escapedByte(text[i++]);
        else
            result += text.substr(std::exchange(i, i + length), length);
    }
    return result;
}

/// Applies asUtf8() to all texts and keys in a value.
template <class Json>
Json asUtf8(const Json& value) {
    if (value.is_string())
        return asUtf8(std::string_view(value.template get_ref<const std::string&>()));
    if (!value.is_structured()) return value;
    Json result = value.is_array() ? Json::array() : Json::object();
    for (const auto& [key, member] : value.items()) {
        if (value.is_array())
            result.push_back(asUtf8(member));
        else
            result[asUtf8(std::string_view(key))] = asUtf8(member);
    }
    return result;
}

template <class Json>
std::string dumped(const Json& value, int indentation, bool ascii) {
    constexpr auto kThrow = nlohmann::json::error_handler_t::strict;
    constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
    try {
        return value.dump(indentation, ' ', ascii, kThrow);
    } catch (const nlohmann::json::type_error&) {
        return asUtf8(value).dump(indentation, ' ', ascii, kReplace);
    }
}

}  // namespace

void checkJsonDepth(std::string_view text, const std::string& where) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kMaxJsonDepth)
                throw Error(
                    ErrorKind::kInput,
                    "the JSON is nested deeper than " + std::to_string(kMaxJsonDepth) + " levels",
                    where, "write it again with fewer levels");
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

nlohmann::json parseJson(std::string_view text, const std::string& where) {
    return parsed<nlohmann::json>(text, where);
}

nlohmann::ordered_json parseOrderedJson(std::string_view text, const std::string& where) {
    return parsed<nlohmann::ordered_json>(text, where);
}

nlohmann::json parseJsonOrNull(std::string_view text) {
    return parsedOrNull<nlohmann::json>(text);
}

nlohmann::ordered_json parseOrderedJsonOrNull(std::string_view text) {
    return parsedOrNull<nlohmann::ordered_json>(text);
}

std::string dumpJson(const nlohmann::json& value, int indentation, bool ascii) {
    return dumped(value, indentation, ascii);
}

std::string dumpJson(const nlohmann::ordered_json& value, int indentation, bool ascii) {
    return dumped(value, indentation, ascii);
}

std::string childPointer(const std::string& parent, std::string_view key) {
    std::string result = parent + '/';
    for (const char c : key) {
        if (c == '~')
            result += "~0";
        else if (c == '/')
            result += "~1";
        else
            result += c;
    }
    return result;
}

std::string childPointer(const std::string& parent, std::size_t index) {
    return parent + '/' + std::to_string(index);
}

std::string shownJson(const nlohmann::json& value) {
    std::string shown = dumpJson(value, -1, true);
    if (shown.size() > 40) shown = shown.substr(0, 37) + "...";
    return shown;
}

}  // namespace peeler
