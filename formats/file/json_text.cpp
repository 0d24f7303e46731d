// SPDX-License-Identifier: Apache-2.0
#include "formats/file/json_text.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"

namespace peeler {
namespace {

// Parsers and the destructors of JSON values recurse; extras of glTF are what nests deepest.
constexpr int kMaxJsonDepth = 200;

void checkDepth(std::string_view text, const std::string& where) {
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
                    where, "no program writes such files");
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

template <class Json>
Json parsed(std::string_view text, const std::string& where) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);  // a byte order mark
    checkDepth(text, where);
    try {
        return Json::parse(text.begin(), text.end());
    } catch (const nlohmann::json::exception& problem) {
        // "[json.exception.parse_error.101] parse error at line 3, column 7: …"
        std::string what = problem.what();
        if (const std::size_t end = what.find("] "); end != std::string::npos)
            what.erase(0, end + 2);
        throw Error(ErrorKind::kInput, "the file is not valid JSON: " + what, where,
                    "copy or export the file again");
    }
}

}  // namespace

nlohmann::json parseJson(std::string_view text, const std::string& where) {
    return parsed<nlohmann::json>(text, where);
}

nlohmann::ordered_json parseOrderedJson(std::string_view text, const std::string& where) {
    return parsed<nlohmann::ordered_json>(text, where);
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
    std::string shown = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    if (shown.size() > 40) shown = shown.substr(0, 37) + "...";
    return shown;
}

}  // namespace peeler
