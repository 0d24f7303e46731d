// SPDX-License-Identifier: Apache-2.0
// The JSON text of a glTF file.
#include "formats/gltf/gltf_json.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"

namespace peeler {
namespace {

// tinygltf and the destructors of JSON values recurse; no real file nests deeper than extras do.
constexpr int kMaxJsonDepth = 200;

void checkDepth(std::string_view text, const std::string& path) {
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
                    path, "this is not a glTF file that an exporter writes");
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

template <class Json>
Json parsed(std::string_view text, const std::string& path) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);  // a byte order mark
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos || text[begin] != '{')
        throw Error(ErrorKind::kInput, "the file is neither binary glTF nor JSON", path,
                    "a scene is a .gltf or .glb file");
    checkDepth(text, path);
    try {
        return Json::parse(text.begin(), text.end());
    } catch (const nlohmann::json::exception& problem) {
        // "[json.exception.parse_error.101] parse error at line 3, column 7: …"
        std::string what = problem.what();
        if (const std::size_t end = what.find("] "); end != std::string::npos)
            what.erase(0, end + 2);
        throw Error(ErrorKind::kInput, "the file is not valid JSON: " + what, path,
                    "copy or export the file again");
    }
}

}  // namespace

nlohmann::json parseGltfJson(std::string_view text, const std::string& path) {
    return parsed<nlohmann::json>(text, path);
}

nlohmann::ordered_json parseOrderedGltfJson(std::string_view text, const std::string& path) {
    return parsed<nlohmann::ordered_json>(text, path);
}

}  // namespace peeler
