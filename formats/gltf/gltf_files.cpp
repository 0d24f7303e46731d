// SPDX-License-Identifier: Apache-2.0
// Decodes data URIs, and finds and reads files inside a folder.
#include "formats/gltf/gltf_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <new>
#include <system_error>

#include "core/base/error.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// A '%' without two hexadecimal digits stands for itself: exporters forget to encode it.
std::string percentDecoded(std::string_view text) {
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '%' && i + 2 < text.size()) {
            const int high = hexDigit(text[i + 1]), low = hexDigit(text[i + 2]);
            if (high >= 0 && low >= 0) {
                result += static_cast<char>(high * 16 + low);
                i += 2;
                continue;
            }
        }
        result += text[i];
    }
    return result;
}

/// RFC 3986 §3.1: a letter, then letters, digits, '+', '-', '.', up to a colon.
bool hasScheme(std::string_view uri) {
    if (uri.empty() || !std::isalpha(static_cast<unsigned char>(uri[0]))) return false;
    const auto end = std::find_if(uri.begin(), uri.end(), [](unsigned char c) {
        return !std::isalnum(c) && c != '+' && c != '-' && c != '.';
    });
    return end != uri.end() && *end == ':';
}

bool startsWithIgnoringCase(std::string_view text, std::string_view prefix) {
    return text.size() >= prefix.size() &&
           std::equal(prefix.begin(), prefix.end(), text.begin(), [](char a, char b) {
               return a == std::tolower(static_cast<unsigned char>(b));
           });
}

/// The path without links and dots. A lack of memory is no error of the file's.
fs::path resolved(const fs::path& path, std::error_code& error) {
    fs::path result = fs::weakly_canonical(path, error);
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    return result;
}

std::vector<std::uint8_t> decodeBase64(std::string_view text, const std::string& where) {
    static const auto values = [] {
        std::array<std::int8_t, 256> table{};
        table.fill(-1);
        const std::string_view alphabet =
            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < alphabet.size(); ++i)
            table[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int8_t>(i);
        table['-'] = 62;  // RFC 4648 §5, which some exporters use
        table['_'] = 63;
        return table;
    }();
    while (!text.empty() && text.back() == '=')
        text.remove_suffix(1);
    std::vector<std::uint8_t> result;
    result.reserve(text.size() / 4 * 3 + 3);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int value = int{values[static_cast<unsigned char>(c)]};  // -1: not of the alphabet
        if (value < 0)
            throw Error(ErrorKind::kInput, "the data URI is not valid base64", where,
                        "export the file again");
        bits = bits << 6U | static_cast<std::uint32_t>(value);
        if ((count += 6) >= 8) {
            count -= 8;
            result.push_back(static_cast<std::uint8_t>(bits >> static_cast<unsigned>(count)));
        }
    }
    return result;
}

[[noreturn]] void refuseName(
    const std::string& name, const std::string& why, const std::string& where,
    const char* hint = "put the file beside the scene file and name it relative to it") {
    throw Error(ErrorKind::kInput, "\"" + name.substr(0, 200) + "\" is not read: " + why, where,
                hint);
}

}  // namespace

bool isDataUri(std::string_view uri) {
    return startsWithIgnoringCase(uri, "data:");
}

std::vector<std::uint8_t> decodeDataUri(std::string_view uri, const std::string& where) {
    const std::size_t comma = uri.find(',');
    if (!isDataUri(uri) || comma == std::string_view::npos)
        throw Error(ErrorKind::kInput, "the data URI has no comma", where, "export the file again");
    const std::string_view header = uri.substr(0, comma);
    const std::string_view body = uri.substr(comma + 1);
    const std::string_view base64 = ";base64";
    if (header.size() >= base64.size() &&
        startsWithIgnoringCase(header.substr(header.size() - base64.size()), base64))
        return body.find('%') == std::string_view::npos ? decodeBase64(body, where)
                                                        : decodeBase64(percentDecoded(body), where);
    const std::string text = percentDecoded(body);
    return {text.begin(), text.end()};
}

GltfFolder::GltfFolder(const fs::path& scene_file, std::uint64_t max_file_bytes, bool allow_outside)
    : max_file_bytes_(max_file_bytes), allow_outside_(allow_outside) {
    std::error_code error;
    const fs::path parent = scene_file.parent_path();
    folder_ = fs::canonical(parent.empty() ? fs::path(".") : parent, error);
    if (error) failToOpen(scene_file, error.value());
}

std::optional<fs::path> GltfFolder::find(const std::string& uri) const {
    if (hasScheme(uri)) return {};
    return findFile(percentDecoded(uri));
}

std::optional<fs::path> GltfFolder::findFile(const std::string& file_name) const {
    const fs::path name(file_name);
    if (name.empty() || name.native().find('\0') != std::string::npos) return {};
    // It is not even asked whether the file is there: that alone can mount what is far away.
    if (!allow_outside_ &&
        (name.is_absolute() || std::find(name.begin(), name.end(), "..") != name.end()))
        return {};
    std::error_code error;
    const fs::path file = resolved(folder_ / name, error);
    if (error) return {};
    return file;
}

std::vector<std::uint8_t> GltfFolder::read(const std::string& uri, const std::string& where) const {
    if (hasScheme(uri)) refuseName(uri, "only data: URIs and paths are", where);
    return read(percentDecoded(uri), uri, where);
}

std::vector<std::uint8_t> GltfFolder::readFile(const std::string& name,
                                               const std::string& where) const {
    return read(name, name, where);
}

/// `shown` is the name as the scene has it.
std::vector<std::uint8_t> GltfFolder::read(const std::string& name, const std::string& shown,
                                           const std::string& where) const {
    const auto refuseOutside = [&](const std::string& why) {
        if (!allow_outside_)
            refuseName(shown, why, where,
                       "put the file beside the scene file, or trust the scene: `allow_outside`");
    };
    if (name.empty() || name.find('\0') != std::string::npos)
        refuseName(shown, "it is not a file name", where);
    const fs::path relative(name);
    if (relative.is_absolute()) refuseOutside("it is an absolute path");
    if (std::find(relative.begin(), relative.end(), "..") != relative.end())
        refuseOutside("\"..\" leads out of the scene's folder");

    std::error_code error;
    const fs::path file = resolved(folder_ / relative, error);
    if (error) refuseName(shown, error.message(), where);
    const auto [folder_end, file_end] =
        std::mismatch(folder_.begin(), folder_.end(), file.begin(), file.end());
    if (folder_end != folder_.end())
        refuseOutside("a symbolic link leads out of the scene's folder");
    try {
        return readRegularFile(file, max_file_bytes_);
    } catch (const Error& problem) {
        throw Error(problem.kind(), "\"" + name + "\": " + problem.what(), where, problem.hint());
    }
}

}  // namespace peeler
