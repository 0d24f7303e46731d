// SPDX-License-Identifier: Apache-2.0
#include "core/gl/program.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <utility>

#include <peeler/error.h>
#include "core/gl/objects.h"

namespace peeler::gl {
namespace {

std::string rawText(const std::string& name) {
    // For shader development without rebuilding: files in the folder PEELER_SHADERS replace
    // embedded files.
    if (const char* folder = std::getenv("PEELER_SHADERS"); folder && *folder) {
        std::ifstream file(std::filesystem::path(folder) / name, std::ios::binary);
        if (file) return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    }
    for (const auto& source : embeddedShaders())
        if (source.name == name) return std::string(source.text);
    throw Error(ErrorKind::kInternal, "unknown shader", name);
}

/// Returns the name of a file's include guard. The guard is needed because an #include may be
/// inside an #if, so that only the preprocessor knows whether a file is included twice.
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

namespace {

struct Stage {
    std::string_view extension;
    GLenum type;
};
constexpr std::array<Stage, 3> kStages = {{
    {".vert", GL_VERTEX_SHADER},
    {".frag", GL_FRAGMENT_SHADER},
    {".comp", GL_COMPUTE_SHADER},
}};

GLenum stageOf(std::string_view file) {
    for (const auto& stage : kStages)
        if (file.ends_with(stage.extension)) return stage.type;
    throw Error(ErrorKind::kInternal, "no shader stage has this extension", std::string(file));
}

template <class GetIv, class GetLog>
std::string infoLog(GLuint name, GetIv get_iv, GetLog get_log) {
    GLint length = 0;
    get_iv(name, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(length), '\0');
    if (length > 0) get_log(name, length, nullptr, log.data());
    return log;
}

/// Saves a program's shaders, as passed to the driver, to the folder PEELER_SAVE_SHADERS: for bug
/// reports about a driver, and as input for other GLSL compilers. All files of a program have the
/// same stem.
void save(std::span<const std::string_view> files, std::span<const std::string> texts) {
    const char* folder = std::getenv("PEELER_SAVE_SHADERS");
    if (!folder || !*folder) return;
    std::string all, names;
    for (std::size_t i = 0; i < files.size(); ++i) {
        all += texts[i];
        names += std::string(files[i].substr(0, files[i].find('.'))) + '-';
    }
    std::ostringstream stem;
    stem << names << std::hex << std::hash<std::string>()(all);
    for (std::size_t i = 0; i < files.size(); ++i) {
        const std::string_view extension = files[i].substr(files[i].rfind('.'));
        std::ofstream(std::filesystem::path(folder) / (stem.str() + std::string(extension)))
            << texts[i];
    }
}

GLuint compile(const Functions& gl, std::string_view file, const std::string& source) {
    const GLuint shader = gl.CreateShader(stageOf(file));
    const char* text = source.c_str();
    gl.ShaderSource(shader, 1, &text, nullptr);
    gl.CompileShader(shader);
    GLint compiled = GL_FALSE;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled != GL_TRUE) {
        const std::string log = infoLog(shader, gl.GetShaderiv, gl.GetShaderInfoLog);
        gl.DeleteShader(shader);
        checkErrors(gl, "compiling a shader");
        throw Error(ErrorKind::kInternal, "a shader does not compile: " + log, std::string(file));
    }
    return shader;
}

}  // namespace

Program::Program(const Functions& gl, const std::vector<std::string_view>& files,
                 const std::vector<std::string>& definitions)
    : Program(gl) {  // delegates, so that the destructor runs if the rest throws
    // GLSL requires extensions to be enabled before all other code. This extension does not affect
    // programs that do not use it.
    std::string prologue =
        "#version 450 core\n"
        "#ifdef GL_EXT_shader_framebuffer_fetch\n"
        "#extension GL_EXT_shader_framebuffer_fetch : enable\n"
        "#endif\n";
    for (std::string definition : definitions) {
        std::replace(definition.begin(), definition.end(), '=', ' ');
        prologue += "#define " + definition + "\n";
    }
    std::vector<std::string> texts;
    for (const auto& file : files)
        texts.push_back(prologue + shaderText(file));
    save(files, texts);
    std::string names;
    for (std::size_t i = 0; i < files.size(); ++i) {
        const GLuint shader = compile(gl, files[i], texts[i]);
        gl.AttachShader(name_, shader);
        gl.DeleteShader(shader);  // marks it for deletion with the program
        names += std::string(names.empty() ? "" : " + ") + std::string(files[i]);
    }
    gl.LinkProgram(name_);
    GLint linked = GL_FALSE;
    gl.GetProgramiv(name_, GL_LINK_STATUS, &linked);
    if (linked != GL_TRUE) {
        checkErrors(gl, "linking a program");
        throw Error(
            ErrorKind::kInternal,
            "a program does not link: " + infoLog(name_, gl.GetProgramiv, gl.GetProgramInfoLog),
            names);
    }
}

Program::Program(Program&& other) noexcept
    : gl_(other.gl_), name_(std::exchange(other.name_, 0U)) {}

Program& Program::operator=(Program&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(name_, other.name_);
    return *this;
}

Program::~Program() {
    if (name_) gl_->DeleteProgram(name_);
}

void Program::use() const {
    gl_->UseProgram(name_);
}

void Program::set(int location, int x, int y, int z, int w) const {
    gl_->ProgramUniform4i(name_, location, x, y, z, w);
}

}  // namespace peeler::gl
