// SPDX-License-Identifier: Apache-2.0
#include "core/gl/shader_sources.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "core/base/error.h"

namespace peeler::gl {
namespace {

std::string rawText(const std::string& name) {
    // While developing a shader one does not want to rebuild: PEELER_SHADERS points at the folder.
    if (const char* folder = std::getenv("PEELER_SHADERS"); folder && *folder) {
        std::ifstream file(std::filesystem::path(folder) / name, std::ios::binary);
        if (file) return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    }
    for (const auto& source : embeddedShaders())
        if (source.name == name) return std::string(source.text);
    throw Error(ErrorKind::kInternal, "there is no such shader", name);
}

/// Includes may stand inside #if branches, so the preprocessor decides what is read twice, not we.
std::string guardOf(std::string name) {
    for (char& c : name)
        if (c == '.') c = '_';
    return "INCLUDED_" + name;
}

std::string expanded(const std::string& name) {
    std::string out;
    std::istringstream lines(rawText(name));
    for (std::string line; std::getline(lines, line);) {
        constexpr std::string_view kInclude = "#include \"";
        if (line.starts_with(kInclude)) {
            const auto end = line.find('"', kInclude.size());
            const std::string file = line.substr(kInclude.size(), end - kInclude.size());
            const std::string guard = guardOf(file);
            out.append("#ifndef ").append(guard).append("\n#define ").append(guard).append("\n");
            out.append(expanded(file)).append("#endif\n");
        } else {
            out += line + '\n';
        }
    }
    return out;
}

}  // namespace

std::string shaderText(std::string_view name) {
    return expanded(std::string(name));
}

}  // namespace peeler::gl
