// SPDX-License-Identifier: Apache-2.0
#include "core/gl/objects.h"

#include <peeler/error.h>

namespace peeler::gl {

namespace {

/// Maps the first bytes of a buffer. Throws Error (kMemory) if the driver cannot map them.
void* mapped(const Functions& gl, GLuint buffer, std::size_t bytes, GLbitfield access) {
    void* const data = gl.MapNamedBufferRange(buffer, 0, static_cast<GLsizeiptr>(bytes), access);
    if (data) return data;
    checkErrors(gl, "mapping a buffer");
    throw Error(ErrorKind::kMemory,
                "the driver cannot map a buffer of " + std::to_string(bytes) + " bytes");
}

GLuint newBuffer(const Functions& gl) {
    GLuint name = 0;
    gl.CreateBuffers(1, &name);
    return name;
}

}  // namespace

Buffer::Mapping::Mapping(const Functions& gl, GLuint buffer, std::size_t bytes, GLbitfield access)
    : gl_(&gl), buffer_(buffer), data_(mapped(gl, buffer, bytes, access)) {}

// GL forbids zero-sized storage, but an empty scene is valid here.
Buffer::Buffer(const Functions& gl, std::size_t bytes)
    : Object(gl, newBuffer(gl)), size_(bytes ? bytes : 4) {
    gl.NamedBufferStorage(name(), static_cast<GLsizeiptr>(size_), nullptr,
                          GL_MAP_READ_BIT | GL_MAP_WRITE_BIT);
    checkErrors(gl, "allocating " + std::to_string(size_) + " bytes of buffer storage");
}

Buffer::Mapping Buffer::read(std::size_t bytes) const {
    return {gl(), name(), bytes ? bytes : 4, GL_MAP_READ_BIT};
}

Buffer::Mapping Buffer::overwrite(std::size_t bytes) const {
    return {gl(), name(), bytes ? bytes : 4, GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT};
}

void Buffer::clearToZero(std::size_t bytes) const {
    const GLuint zero = 0;
    gl().ClearNamedBufferSubData(name(), GL_R32UI, 0, static_cast<GLsizeiptr>(bytes),
                                 GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

void Buffer::bindStorage(unsigned binding) const {
    gl().BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name());
}

void Buffer::bindUniform(unsigned binding, std::size_t offset, std::size_t bytes) const {
    gl().BindBufferRange(GL_UNIFORM_BUFFER, binding, name(), static_cast<GLintptr>(offset),
                         static_cast<GLsizeiptr>(bytes));
}

Fence::Fence(const Functions& gl) : sync_(gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0), {&gl}) {
    gl.Flush();
}

void Fence::wait() const {
    // The timeout, for drivers that do not report a lost context. With other drivers, the wait ends
    // when the context is lost.
    constexpr GLuint64 kNanoseconds = 600'000'000'000;
    const Functions& gl = *sync_.get_deleter().gl;
    const GLenum came = gl.ClientWaitSync(sync_.get(), 0, kNanoseconds);
    if (came == GL_ALREADY_SIGNALED || came == GL_CONDITION_SATISFIED) return;
    checkErrors(gl, "waiting for the GPU");
    throw Error(ErrorKind::kDevice, "the GPU did not finish its work within ten minutes");
}

ReadBack::ReadBack(const Functions& gl, std::size_t bytes)
    : Object(gl, newBuffer(gl)), size_(bytes) {
    constexpr GLbitfield kAccess = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    gl.NamedBufferStorage(name(), static_cast<GLsizeiptr>(bytes), nullptr,
                          kAccess | GL_CLIENT_STORAGE_BIT);
    checkErrors(gl, "allocating " + std::to_string(bytes) + " bytes to read back");
    data_ = mapped(gl, name(), bytes, kAccess);
}

void ReadBack::copy(const Functions& gl, const Buffer& from, std::size_t bytes) {
    if (bytes == 0) return;
    if (size_ < bytes) {
        *this = {};  // free the old buffer first, so that two are never held
        *this = ReadBack(gl, bytes);
    }
    // The first barrier bit is for this copy. The second bit is for later passes that write to the
    // copied buffer.
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(from.name(), name(), 0, 0, static_cast<GLsizeiptr>(bytes));
}

Texture makeTexture2D(const Functions& gl, GLenum format, int width, int height, int levels) {
    GLuint name = 0;
    gl.CreateTextures(GL_TEXTURE_2D, 1, &name);
    Texture texture(gl, name);
    gl.TextureStorage2D(name, levels, format, width, height);
    checkErrors(gl,
                "allocating a texture of " + std::to_string(width) + "x" + std::to_string(height));
    return texture;
}

Texture makeTexture2DMultisample(const Functions& gl, GLenum format, int samples, int width,
                                 int height) {
    GLuint name = 0;
    gl.CreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &name);
    Texture texture(gl, name);
    gl.TextureStorage2DMultisample(name, samples, format, width, height, GL_TRUE);
    checkErrors(gl, "allocating a texture of " + std::to_string(width) + "x" +
                        std::to_string(height) + " with " + std::to_string(samples) + " samples");
    return texture;
}

Texture makeTexture2DArray(const Functions& gl, GLenum format, int width, int height, int layers) {
    GLuint name = 0;
    gl.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
    Texture texture(gl, name);
    gl.TextureStorage3D(name, 1, format, width, height, layers);
    checkErrors(gl, "allocating " + std::to_string(layers) + " textures of " +
                        std::to_string(width) + "x" + std::to_string(height));
    return texture;
}

Texture makeTextureCube(const Functions& gl, GLenum format, int size, int levels) {
    GLuint name = 0;
    gl.CreateTextures(GL_TEXTURE_CUBE_MAP, 1, &name);
    Texture texture(gl, name);
    gl.TextureStorage2D(name, levels, format, size, size);
    checkErrors(gl, "allocating a cube map of " + std::to_string(size) + " texels per side");
    return texture;
}

Framebuffer makeFramebuffer(const Functions& gl, const std::vector<GLuint>& colors, GLuint depth) {
    GLuint name = 0;
    gl.CreateFramebuffers(1, &name);
    Framebuffer framebuffer(gl, name);
    std::vector<GLenum> buffers;
    for (const GLuint color : colors) {
        const auto attachment = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + buffers.size());
        gl.NamedFramebufferTexture(name, attachment, color, 0);
        buffers.push_back(attachment);
    }
    if (depth) gl.NamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depth, 0);
    gl.NamedFramebufferDrawBuffers(name, static_cast<GLsizei>(buffers.size()), buffers.data());
    if (gl.CheckNamedFramebufferStatus(name, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
        checkErrors(gl, "making a framebuffer");
        throw Error(ErrorKind::kDevice, "the driver rejects one of peeler's framebuffers");
    }
    return framebuffer;
}

Framebuffer makeEmptyFramebuffer(const Functions& gl, int width, int height) {
    GLuint name = 0;
    gl.CreateFramebuffers(1, &name);
    gl.NamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
    gl.NamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
    return {gl, name};
}

void waitForGpu(const Functions& gl) {
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                     GL_SHADER_STORAGE_BARRIER_BIT);
    gl.Finish();
}

void checkErrors(const Functions& gl, const std::string& stage) {
    if (gl.GetGraphicsResetStatus() != GL_NO_ERROR) {
        throw Error(ErrorKind::kDevice, "the GL context was lost while " + stage, "",
                    "the GPU was reset or taken away; try again, or use " + Parameter::kBackend +
                        " osmesa");
    }
    const GLenum code = gl.GetError();
    if (code == GL_NO_ERROR) return;
    if (code == GL_OUT_OF_MEMORY) {
        throw Error(ErrorKind::kMemory, "the GL driver ran out of memory while " + stage, "",
                    "lower " + Parameter::kMemory + " or the picture's size");
    }
    throw Error(ErrorKind::kInternal, "GL error " + std::to_string(code) + " while " + stage);
}

namespace {

struct BlendRow {
    GLenum equation, source_rgb, destination_rgb, source_alpha, destination_alpha;
};
// Indexed by Blend, starting with kMax.
constexpr BlendRow kBlendRows[] = {
    {GL_MAX, GL_ONE, GL_ONE, GL_ONE, GL_ONE},
    {GL_FUNC_ADD, GL_ONE, GL_ONE, GL_ONE, GL_ONE},
    {GL_FUNC_ADD, GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA},
    {GL_FUNC_ADD, GL_ONE, GL_ONE_MINUS_SRC1_COLOR, GL_ONE, GL_ONE_MINUS_SRC1_ALPHA},
    {GL_FUNC_ADD, GL_ONE, GL_ONE_MINUS_SRC_COLOR, GL_ONE, GL_ONE_MINUS_SRC_ALPHA},
    {GL_FUNC_ADD, GL_ONE_MINUS_DST_ALPHA, GL_ONE, GL_ONE_MINUS_DST_ALPHA, GL_ONE},
};

void apply(const Functions& gl, GLuint attachment, Blend blend) {
    if (blend == Blend::kOff) {
        gl.Disablei(GL_BLEND, attachment);
        return;
    }
    const BlendRow& row = kBlendRows[static_cast<std::size_t>(blend) - 1];
    gl.Enablei(GL_BLEND, attachment);
    gl.BlendEquationi(attachment, row.equation);
    gl.BlendFuncSeparatei(attachment, row.source_rgb, row.destination_rgb, row.source_alpha,
                          row.destination_alpha);
}

GLenum depthFunction(DepthTest test) {
    constexpr GLenum kFunctions[] = {GL_ALWAYS, GL_GREATER, GL_LEQUAL, GL_ALWAYS, GL_GEQUAL};
    return kFunctions[static_cast<std::size_t>(test)];
}

}  // namespace

void apply(const Functions& gl, const PassState& state) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, state.framebuffer);
    gl.Viewport(0, 0, state.viewport_width, state.viewport_height);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(state.scissor_x, state.scissor_y, state.scissor_width, state.scissor_height);
    // Reversed Z: clip space depth 0–1, 1 at the near plane.
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    for (GLuint i = 0; i < kMaxAttachments; ++i)
        apply(gl, i, state.blend[i]);
    setEnabled(gl, GL_DEPTH_CLAMP, state.depth_clamp);
    gl.Disable(GL_STENCIL_TEST);
    gl.Disable(GL_DITHER);
    setEnabled(gl, GL_MULTISAMPLE, state.multisampled);
    gl.Disable(GL_SAMPLE_SHADING);
    gl.MinSampleShading(1);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    if (state.depth_test != DepthTest::kOff) {
        gl.Enable(GL_DEPTH_TEST);
        gl.DepthFunc(depthFunction(state.depth_test));
        gl.DepthMask(state.depth_test == DepthTest::kInFront ? GL_FALSE : GL_TRUE);
    } else {
        gl.Disable(GL_DEPTH_TEST);
        gl.DepthMask(GL_FALSE);
    }
}

void clear(const Functions& gl, PassState state, GLuint red) {
    state.depth_test = DepthTest::kNearest;  // enables depth writes, which a clear needs
    apply(gl, state);
    const float far = 0;
    const GLuint color[4] = {red, 0, 0, 0};
    gl.ClearNamedFramebufferfv(state.framebuffer, GL_DEPTH, 0, &far);
    gl.ClearNamedFramebufferuiv(state.framebuffer, GL_COLOR, 0, color);
}

}  // namespace peeler::gl
