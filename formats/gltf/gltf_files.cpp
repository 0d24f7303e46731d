// SPDX-License-Identifier: Apache-2.0
// Data URI decoding, and the sandboxed file access of GltfFolder.
#include "formats/gltf/gltf_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <new>
#include <system_error>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/file/regular_file.h"
#include "formats/file/text_words.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// Decodes percent-encoding. Keeps a '%' that is not followed by two hexadecimal digits, since some
/// exporters do not encode '%'.
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

/// Whether the URI has a scheme (RFC 3986 §3.1): a letter, then letters, digits, '+', '-' or '.',
/// then a colon.
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

/// Returns the canonical path. Throws std::bad_alloc instead of setting `error`, since lack of
/// memory is not a fault of the file.
fs::path resolved(const fs::path& path, std::error_code& error) {
    fs::path result = fs::weakly_canonical(path, error);
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    return result;
}

std::vector<std::uint8_t> decodeBase64(std::string_view text, const std::string& where) {
    static constexpr std::int8_t kNone = -1, kSpace = -2;
    static const auto values = [] {
        std::array<std::int8_t, 256> table{};
        table.fill(kNone);
        for (const char c : std::string_view(kBase64Space))
            table[static_cast<unsigned char>(c)] = kSpace;
        const std::string_view alphabet =
            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < alphabet.size(); ++i)
            table[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int8_t>(i);
        table['-'] = 62;  // some exporters use '-' and '_' (RFC 4648 §5)
        table['_'] = 63;
        return table;
    }();
    text = text.substr(0, text.find_last_not_of(std::string("=") + kBase64Space) + 1);
    std::vector<std::uint8_t> result;
    result.reserve(text.size() / 4 * 3 + 3);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int value = int{values[static_cast<unsigned char>(c)]};
        if (value == kSpace) continue;
        if (value == kNone)
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

/// Returns the name without enclosing quotation marks, with slashes instead of backslashes.
std::string withSlashes(std::string_view name) {
    if (name.size() >= 2 && name.front() == '"' && name.back() == '"')
        name = name.substr(1, name.size() - 2);
    std::string result(name);
    std::ranges::replace(result, '\\', '/');
    return result;
}

/// Whether a name begins with a Windows drive, "C:/", which would be a scheme in RFC 3986.
bool hasDrive(std::string_view name) {
    return name.size() > 2 && std::isalpha(static_cast<unsigned char>(name[0])) && name[1] == ':' &&
           (name[2] == '/' || name[2] == '\\');
}

/// Returns the path in a URI, percent-decoded, or no value if the URI has a scheme other than
/// "file".
std::optional<std::string> pathOf(std::string_view uri) {
    if (startsWithIgnoringCase(uri, "file:")) {
        uri.remove_prefix(5);
        if (uri.starts_with("//")) uri.remove_prefix(2);
    } else if (hasScheme(uri) && !hasDrive(uri)) {
        return {};
    }
    return percentDecoded(uri);
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

/// A file name in a scene.
struct GltfFolder::Named {
    std::string shown;  ///< name in messages
    std::string name;   ///< name as a path
    std::string from;   ///< the folder to which `name` is relative

    fs::path whole() const { return hasDrive(name) ? fs::path(name) : fs::path(from) / name; }
};

struct GltfFolder::Found {
    fs::path file;                   ///< canonical path; empty if the file may not be read
    std::optional<Error> problem{};  ///< the reason why the file may not be read
    /// Name, in the folder, of the file that is used if `name` does not exist; "" otherwise.
    std::string in_place{};
};

/// Returns the path of a name that is relative to the folder. The file need not exist. Throws Error
/// (kInput) without `where` if access is not allowed.
fs::path GltfFolder::allowed(const fs::path& name) const {
    const auto refuse = [](const std::string& why) {
        throw Error(ErrorKind::kInput, why, "",
                    "put the file beside the scene file and name it relative to it");
    };
    const auto refuseOutside = [&](const std::string& why) {
        if (!allow_outside_)
            throw Error(ErrorKind::kInput, why, "",
                        "put the file beside the scene file, or trust the scene: " +
                            Parameter::kAllowOutside);
    };
    if (name.empty() || name.native().find('\0') != std::string::npos)
        refuse("it is not a file name");
    // Without permission, do not even check whether the file exists: the check could mount a remote
    // folder.
    if (name.is_absolute() || hasDrive(name.native())) refuseOutside("it is an absolute path");
    if (*name.lexically_normal().begin() == "..")
        refuseOutside("\"..\" leads out of the scene's folder");
    std::error_code error;
    fs::path file = resolved(folder_ / name, error);
    if (error) refuse(error.message());
    if (std::mismatch(folder_.begin(), folder_.end(), file.begin(), file.end()).first !=
        folder_.end())
        refuseOutside("a symbolic link leads out of the scene's folder");
    return file;
}

/// Returns the names in a subfolder. The keys are the names in lower case.
const GltfFolder::Listing& GltfFolder::listing(const fs::path& folder) const {
    const auto [known, is_new] = listings_.try_emplace(folder);
    if (!is_new) return known->second;
    try {
        for (std::string& name : namesIn(allowed(folder)))
            known->second.emplace(lowerCase(name), std::move(name));
    } catch (const Error&) {  // a link leads out of the folder, or the folder cannot be listed
    }
    return known->second;
}

/// Finds a regular file by its name relative to the scene's folder; the name must not contain "..".
/// Ignores case if only one file then matches. Returns the name as spelt on disk.
std::optional<fs::path> GltfFolder::present(const fs::path& name) const {
    fs::path found = ".";
    for (const fs::path& component : name) {
        const auto [begin, end] = listing(found).equal_range(lowerCase(component.native()));
        const auto exact = std::find_if(
            begin, end, [&](const auto& entry) { return entry.second == component.native(); });
        if (exact == end && std::distance(begin, end) != 1) return {};
        found /= exact == end ? begin->second : exact->second;
    }
    try {
        std::error_code error;
        if (fs::is_regular_file(allowed(found), error)) return found.lexically_normal();
    } catch (const Error&) {  // a link leads out of the scene's folder
    }
    return {};
}

/// Returns the file that matches as many components at the end of the name's path as possible. For
/// each number of components, searches the name's own folder (Named::from) before the scene's
/// folder.
std::optional<fs::path> GltfFolder::withSameEnd(const Named& named) const {
    constexpr std::size_t kMostComponents = 16;
    std::vector<fs::path> components;
    const std::string name = withSlashes(named.name);
    for (const fs::path& component : fs::path(hasDrive(name) ? name.substr(2) : name))
        if (!component.empty() && component != "/" && component != "." && component != "..")
            components.push_back(component);
    const std::size_t count = components.size();
    for (std::size_t first = count - std::min(count, kMostComponents); first < count; ++first) {
        fs::path end;
        for (std::size_t i = first; i < count; ++i)
            end /= components[i];
        if (!named.from.empty())
            if (auto found = present((named.from / end).lexically_normal())) return found;
        if (auto found = present(end)) return found;
    }
    return {};
}

GltfFolder::Found GltfFolder::look(const Named& named) const {
    Found found;
    try {
        found.file = allowed(named.whole());
        if (isSeen(found.file)) return found;
    } catch (const Error& problem) {
        found.problem = problem;
    }
    if (named.name.find('\0') != std::string::npos) return found;
    if (const auto other = withSameEnd(named))
        return {allowed(*other), {}, other->generic_string()};
    return found;
}

std::optional<fs::path> GltfFolder::find(const std::string& uri) const {
    const auto path = pathOf(uri);
    if (!path) return {};
    Found found = look({uri, *path, {}});
    if (found.problem) return {};
    return std::move(found.file);
}

std::optional<fs::path> GltfFolder::findFile(const std::string& name,
                                             const std::string& from) const {
    Found found = look({name, withSlashes(name), from});
    if (found.problem) return {};
    return std::move(found.file);
}

std::string GltfFolder::nameOf(const std::string& name) const {
    const Named named{name, withSlashes(name), {}};
    const Found found = look(named);
    return found.in_place.empty() ? named.whole().generic_string() : found.in_place;
}

std::vector<std::uint8_t> GltfFolder::read(const std::string& uri, const std::string& where,
                                           ReadWarnings& warnings) const {
    const auto path = pathOf(uri);
    if (!path)
        throw Error(
            ErrorKind::kInput,
            "\"" + uri.substr(0, kMostOfName) + "\" is not read: only data: URIs and paths are",
            where, "put the file beside the scene file and name it relative to it");
    return read({uri, *path, {}}, where, warnings);
}

std::vector<std::uint8_t> GltfFolder::readFile(const std::string& name, const std::string& from,
                                               const std::string& where,
                                               ReadWarnings& warnings) const {
    return read({name, withSlashes(name), from}, where, warnings);
}

std::vector<std::uint8_t> GltfFolder::read(const Named& named, const std::string& where,
                                           ReadWarnings& warnings) const {
    const std::string shown = "\"" + named.shown.substr(0, kMostOfName) + "\"";
    const Found found = look(named);
    if (found.problem)
        throw Error(ErrorKind::kInput, shown + " is not read: " + found.problem->whatText(), where,
                    found.problem->hintText());
    if (!found.in_place.empty())
        warnings.warn("The file " + shown + " does not exist; \"" + found.in_place +
                          "\" in the scene's folder is used instead.",
                      where);
    try {
        return readRegularFile(found.file, max_file_bytes_);
    } catch (const Error& problem) {
        throw Error(problem.kind(), shown + ": " + problem.whatText(), where, problem.hintText());
    }
}

}  // namespace peeler
