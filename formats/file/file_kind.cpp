// SPDX-License-Identifier: Apache-2.0
#include "formats/file/file_name.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "core/base/error.h"

namespace peeler {
namespace {

using namespace std::string_view_literals;

struct Magic {
    std::string_view bytes;
    FileKind kind;
};
constexpr Magic kMagics[] = {
    {"\x76\x2f\x31\x01"sv, FileKind::kExr},
    {"glTF"sv, FileKind::kGltf},
    {"{"sv, FileKind::kGltf},
    {"\x89PNG\r\n\x1a\n"sv, FileKind::kPng},
    {"\xff\xd8\xff"sv, FileKind::kJpeg},
    {"II\x2a\0"sv, FileKind::kTiff},
    {"MM\0\x2a"sv, FileKind::kTiff},
    {"#?RADIANCE"sv, FileKind::kHdr},
    {"#?RGBE"sv, FileKind::kHdr},
};

/// The first bytes without byte order mark and white space, which JSON may begin with.
std::string beginning(const std::string& path) {
    if (std::filesystem::is_directory(path)) {
        throw Error(ErrorKind::kInput, "cannot read: it is a folder", path, "name a file in it");
    }
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw Error(ErrorKind::kInput, std::string("cannot read: ") + std::strerror(errno), path,
                    "check the path");
    }
    std::array<char, 256> bytes{};
    file.read(bytes.data(), bytes.size());
    std::string_view text(bytes.data(), static_cast<std::size_t>(file.gcount()));
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return std::string(text);
}

}  // namespace

FileKind fileKind(const std::string& path) {
    const std::string start = beginning(path);
    for (const Magic& magic : kMagics) {
        if (start.starts_with(magic.bytes)) return magic.kind;
    }
    return FileKind::kUnknown;
}

}  // namespace peeler
