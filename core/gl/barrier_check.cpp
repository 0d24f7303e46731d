// SPDX-License-Identifier: Apache-2.0
#include "core/gl/barrier_check.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <peeler/error.h>

namespace peeler::gl {
namespace {

// The barrier bits that a shader's writes need before other shaders access them, and before
// commands clear, copy or map the buffer.
constexpr GLbitfield kByShaders = GL_SHADER_STORAGE_BARRIER_BIT;
constexpr GLbitfield kByCommands = GL_BUFFER_UPDATE_BARRIER_BIT;

/// A storage block of a program.
struct Block {
    std::string name;
    GLuint binding = 0;
    bool writes = false;
};

/// The accesses to a buffer since the last barrier.
struct Use {
    GLbitfield unseen = 0;      ///< barrier bits still missing since the last write
    std::uint64_t written = 0;  ///< the last pass that wrote the buffer
    std::uint64_t read = 0;     ///< the last pass that read the buffer; 0: no pass
    std::string writer;         ///< name of the storage block that the last write used
};

/// The tracked state of the context whose functions are checked on this thread.
struct Checked {
    Functions actual;
    PFNGLGETPROGRAMINTERFACEIVPROC get_program_interface_iv = nullptr;
    PFNGLGETPROGRAMRESOURCENAMEPROC get_program_resource_name = nullptr;
    PFNGLGETPROGRAMRESOURCEIVPROC get_program_resource_iv = nullptr;

    std::map<GLuint, std::set<std::string>> shader_writes;  ///< blocks that a shader may write
    /// blocks that the program's shaders may write
    std::map<GLuint, std::set<std::string>> program_writes;
    std::map<GLuint, std::vector<Block>> blocks;  ///< storage blocks of each program
    std::map<GLuint, GLuint> bound;               ///< buffer of each binding
    std::map<GLuint, Use> uses;                   ///< accesses to each buffer
    GLuint program = 0;
    std::uint64_t pass = 1;
};

Checked& checked() {
    thread_local Checked of_this_thread;
    return of_this_thread;
}

[[noreturn]] void fail(const std::string& what) {
    throw Error(ErrorKind::kInternal, what, "PEELER_CHECK_BARRIERS");
}

/// Returns the blocks of a shader that are not declared readonly. Searches line by line, because
/// each block is declared on one line, and because a regular expression over the whole shader would
/// take longer than compiling the shader.
std::set<std::string> writtenBlocks(const std::string& text) {
    static const std::regex kBlock(R"((\breadonly\s+)?\bbuffer\s+(\w+)\s*\{)");
    std::set<std::string> names;
    std::istringstream lines(text);
    std::smatch block;
    for (std::string line; std::getline(lines, line);) {
        if (line.find("buffer") == std::string::npos) continue;
        if (std::regex_search(line, block, kBlock) && !block[1].matched) names.insert(block[2]);
    }
    return names;
}

void APIENTRY shaderSource(GLuint shader, GLsizei count, const GLchar* const* texts,
                           const GLint* lengths) {
    std::string all;
    for (GLsizei i = 0; i < count; ++i) {
        if (lengths && lengths[i] >= 0)
            all.append(texts[i], static_cast<std::size_t>(lengths[i]));
        else
            all.append(texts[i]);
    }
    checked().shader_writes[shader] = writtenBlocks(all);
    checked().actual.ShaderSource(shader, count, texts, lengths);
}

void APIENTRY attachShader(GLuint program, GLuint shader) {
    checked().program_writes[program].merge(std::set(checked().shader_writes[shader]));
    checked().actual.AttachShader(program, shader);
}

void APIENTRY linkProgram(GLuint program) {
    Checked& c = checked();
    c.actual.LinkProgram(program);
    std::vector<Block>& blocks = c.blocks[program];
    blocks.clear();
    GLint count = 0, longest = 0;
    c.get_program_interface_iv(program, GL_SHADER_STORAGE_BLOCK, GL_ACTIVE_RESOURCES, &count);
    c.get_program_interface_iv(program, GL_SHADER_STORAGE_BLOCK, GL_MAX_NAME_LENGTH, &longest);
    for (GLuint i = 0; i < static_cast<GLuint>(count); ++i) {
        std::string name(static_cast<std::size_t>(longest), '\0');
        GLsizei length = 0;
        c.get_program_resource_name(program, GL_SHADER_STORAGE_BLOCK, i, longest, &length,
                                    name.data());
        name.resize(static_cast<std::size_t>(length));
        const GLenum property = GL_BUFFER_BINDING;
        GLint binding = 0;
        c.get_program_resource_iv(program, GL_SHADER_STORAGE_BLOCK, i, 1, &property, 1, nullptr,
                                  &binding);
        const bool writes = c.program_writes[program].contains(name);
        blocks.push_back({std::move(name), static_cast<GLuint>(binding), writes});
    }
}

void APIENTRY useProgram(GLuint program) {
    checked().program = program;
    checked().actual.UseProgram(program);
}

void APIENTRY deleteProgram(GLuint program) {
    checked().blocks.erase(program);
    checked().program_writes.erase(program);
    checked().actual.DeleteProgram(program);
}

void APIENTRY bindBufferBase(GLenum target, GLuint binding, GLuint buffer) {
    if (target == GL_SHADER_STORAGE_BUFFER) checked().bound[binding] = buffer;
    checked().actual.BindBufferBase(target, binding, buffer);
}

void APIENTRY deleteBuffers(GLsizei count, const GLuint* names) {
    for (GLsizei i = 0; i < count; ++i) {
        checked().uses.erase(names[i]);
        std::erase_if(checked().bound, [&](const auto& b) { return b.second == names[i]; });
    }
    checked().actual.DeleteBuffers(count, names);
}

void APIENTRY bindFramebuffer(GLenum target, GLuint framebuffer) {
    ++checked().pass;
    checked().actual.BindFramebuffer(target, framebuffer);
}

void APIENTRY memoryBarrier(GLbitfield barriers) {
    for (auto& [buffer, use] : checked().uses) {
        use.unseen &= ~barriers;
        if (barriers & kByShaders) use.read = 0;
    }
    checked().actual.MemoryBarrier(barriers);
}

/// Records the accesses of the current program to the bound buffers.
void useBlocks() {
    Checked& c = checked();
    for (const Block& block : c.blocks[c.program]) {
        const auto bound = c.bound.find(block.binding);
        if (bound == c.bound.end()) fail("no buffer is bound for block " + block.name);
        Use& use = c.uses[bound->second];
        if ((use.unseen & kByShaders) && use.written != c.pass)
            fail("no barrier before the use of block " + block.name +
                 ": an earlier pass wrote its buffer through block " + use.writer);
        if (block.writes && use.read != 0 && use.read != c.pass)
            fail("no barrier before the write to block " + block.name +
                 ", which an earlier pass reads");
    }
    for (const Block& block : c.blocks[c.program]) {
        Use& use = c.uses[c.bound[block.binding]];
        if (!block.writes) {
            use.read = c.pass;
            continue;
        }
        use.unseen = kByShaders | kByCommands;
        use.written = c.pass;
        use.writer = block.name;
    }
}

void APIENTRY drawArrays(GLenum mode, GLint first, GLsizei count) {
    useBlocks();
    checked().actual.DrawArrays(mode, first, count);
}

void APIENTRY drawArraysInstanced(GLenum mode, GLint first, GLsizei count, GLsizei instances) {
    useBlocks();
    checked().actual.DrawArraysInstanced(mode, first, count, instances);
}

void APIENTRY drawElementsInstanced(GLenum mode, GLsizei count, GLenum type, const void* indices,
                                    GLsizei instances) {
    useBlocks();
    checked().actual.DrawElementsInstanced(mode, count, type, indices, instances);
}

void APIENTRY dispatchCompute(GLuint x, GLuint y, GLuint z) {
    ++checked().pass;
    useBlocks();
    ++checked().pass;
    checked().actual.DispatchCompute(x, y, z);
}

void byCommand(GLuint buffer, const char* how) {
    const auto use = checked().uses.find(buffer);
    if (use != checked().uses.end() && (use->second.unseen & kByCommands))
        fail("no barrier before " + std::string(how) +
             " a buffer that a pass wrote through block " + use->second.writer);
}

void* APIENTRY mapNamedBufferRange(GLuint buffer, GLintptr offset, GLsizeiptr length,
                                   GLbitfield access) {
    byCommand(buffer, "mapping");
    return checked().actual.MapNamedBufferRange(buffer, offset, length, access);
}

void APIENTRY clearNamedBufferSubData(GLuint buffer, GLenum internal, GLintptr offset,
                                      GLsizeiptr size, GLenum format, GLenum type,
                                      const void* data) {
    byCommand(buffer, "clearing");
    checked().actual.ClearNamedBufferSubData(buffer, internal, offset, size, format, type, data);
}

void APIENTRY copyNamedBufferSubData(GLuint from, GLuint to, GLintptr from_offset,
                                     GLintptr to_offset, GLsizeiptr size) {
    byCommand(from, "copying");
    byCommand(to, "copying into");
    checked().actual.CopyNamedBufferSubData(from, to, from_offset, to_offset, size);
}

template <class Function>
void load(Function& function, const ProcAddress& lookup, const char* name) {
    function = reinterpret_cast<Function>(lookup(name));
    if (!function) throw Error(ErrorKind::kInternal, std::string("the driver has no ") + name);
}

}  // namespace

void checkBarriers(Functions& functions, const ProcAddress& lookup) {
    const char* const asked = std::getenv("PEELER_CHECK_BARRIERS");
    if (!asked || !*asked) return;
    Checked& c = checked();
    c = {};
    c.actual = functions;
    load(c.get_program_interface_iv, lookup, "glGetProgramInterfaceiv");
    load(c.get_program_resource_name, lookup, "glGetProgramResourceName");
    load(c.get_program_resource_iv, lookup, "glGetProgramResourceiv");
    functions.ShaderSource = shaderSource;
    functions.AttachShader = attachShader;
    functions.LinkProgram = linkProgram;
    functions.UseProgram = useProgram;
    functions.DeleteProgram = deleteProgram;
    functions.BindBufferBase = bindBufferBase;
    functions.DeleteBuffers = deleteBuffers;
    functions.BindFramebuffer = bindFramebuffer;
    functions.MemoryBarrier = memoryBarrier;
    functions.DrawArrays = drawArrays;
    functions.DrawArraysInstanced = drawArraysInstanced;
    functions.DrawElementsInstanced = drawElementsInstanced;
    functions.DispatchCompute = dispatchCompute;
    functions.MapNamedBufferRange = mapNamedBufferRange;
    functions.ClearNamedBufferSubData = clearNamedBufferSubData;
    functions.CopyNamedBufferSubData = copyNamedBufferSubData;
}

}  // namespace peeler::gl
