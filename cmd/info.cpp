// SPDX-License-Identifier: Apache-2.0
// peeler info: what is in a file. The kind is told by the content, not by the name.
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>

#include "cmd/info_kinds.h"
#include "cmd/options.h"
#include "cmd/verbs.h"
#include "core/error.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct FileKind {
    std::string_view magic;
    void (*print)(const InfoOptions&, Console&);
};

constexpr FileKind kFileKinds[] = {
    {"\x76\x2f\x31\x01", printImageInfo},
    {"glTF", printSceneInfo},
    {"{", printSceneInfo},
};

/// The first bytes without byte order mark and white space, which JSON may begin with.
std::string beginning(const fs::path& path) {
    if (fs::is_directory(path)) {
        throw Error(ErrorKind::kInput, "cannot read: it is a folder", path.string(),
                    "name a file in it");
    }
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw Error(ErrorKind::kInput, std::string("cannot read: ") + std::strerror(errno),
                    path.string(), "check the path");
    }
    std::array<char, 256> bytes{};
    file.read(bytes.data(), bytes.size());
    std::string_view text(bytes.data(), static_cast<std::size_t>(file.gcount()));
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return std::string(text);
}

int printInfo(const InfoOptions& options, Console& console) {
    const std::string start = beginning(options.file);
    for (const FileKind& kind : kFileKinds) {
        if (!start.starts_with(kind.magic)) continue;
        kind.print(options, console);
        return 0;
    }
    throw Error(ErrorKind::kInput, "neither a glTF scene nor an OpenEXR image",
                options.file.string(),
                "info reads .gltf, .glb and the .exr files that peeler writes");
}

}  // namespace

VerbAction declareInfo(CLI::App& app) {
    const auto options = std::make_shared<InfoOptions>();
    addValue(
        app, "FILE", "", options->file, [](const std::string& text) { return fs::path(text); },
        "a scene (.gltf, .glb) or a layered image (.exr)")
        ->required();
    app.add_flag("--json", options->json, "print JSON");
    return [options](Console& console) { return printInfo(*options, console); };
}

}  // namespace peeler::cmd
