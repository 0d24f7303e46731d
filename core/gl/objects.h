// SPDX-License-Identifier: Apache-2.0
// Move-only owners of GL objects, and the GL state of a pass.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::gl {

/// The owner of one GL name. `Delete` is the member of Functions that deletes the name. Must not
/// outlive the context.
template <auto Delete>
class Object {
  public:
    Object() = default;
    Object(const Functions& gl, GLuint name) : gl_(&gl), name_(name) {}
    Object(Object&& other) noexcept : gl_(other.gl_), name_(std::exchange(other.name_, 0U)) {}
    Object& operator=(Object&& other) noexcept {
        std::swap(gl_, other.gl_);
        std::swap(name_, other.name_);
        return *this;
    }
    ~Object() {
        if (name_) (gl_->*Delete)(1, &name_);
    }
    GLuint name() const { return name_; }
    explicit operator bool() const { return name_ != 0; }

  protected:
    const Functions& gl() const { return *gl_; }

  private:
    const Functions* gl_ = nullptr;
    GLuint name_ = 0;
};

using Texture = Object<&Functions::DeleteTextures>;
using SamplerObject = Object<&Functions::DeleteSamplers>;
using VertexArray = Object<&Functions::DeleteVertexArrays>;
using Framebuffer = Object<&Functions::DeleteFramebuffers>;

/// A buffer with immutable storage, in GPU memory if available. The CPU accesses it by mapping.
class Buffer : public Object<&Functions::DeleteBuffers> {
  public:
    /// A mapped range, unmapped on destruction. GPU commands must not use the buffer while it is
    /// mapped.
    class Mapping {
      public:
        Mapping(const Functions& gl, GLuint buffer, std::size_t bytes, GLbitfield access);
        Mapping(const Mapping&) = delete;
        Mapping& operator=(const Mapping&) = delete;
        ~Mapping() { gl_->UnmapNamedBuffer(buffer_); }
        template <class T>
        T* as() const {
            return static_cast<T*>(data_);
        }

      private:
        const Functions* gl_;
        GLuint buffer_;
        void* data_;
    };

    Buffer() = default;
    /// Throws Error (kMemory) if the driver runs out of memory.
    Buffer(const Functions& gl, std::size_t bytes);

    std::size_t size() const { return size_; }
    /// Maps the first `bytes` bytes for reading. Call waitForGpu() first.
    Mapping read(std::size_t bytes) const;
    /// Maps the first `bytes` bytes for writing, and discards the contents of the whole buffer.
    /// This is safe while GPU commands still read the buffer, because the driver provides other
    /// memory or waits.
    Mapping overwrite(std::size_t bytes) const;
    /// Sets the first `bytes` bytes to 0, on the GPU.
    void clearToZero(std::size_t bytes) const;
    void bindStorage(unsigned binding) const;
    void bindUniform(unsigned binding, std::size_t offset, std::size_t bytes) const;

  private:
    std::size_t size_ = 0;
};

/// Enlarges the buffer to at least this size; discards its contents. Throws like Buffer.
inline void reserve(const Functions& gl, Buffer& buffer, std::size_t bytes) {
    if (buffer && buffer.size() >= bytes) return;
    buffer = {};  // free the old buffer first, so that two are never held
    buffer = Buffer(gl, bytes);
}

/// A fence in a context's command stream. The CPU can wait for it while the GPU runs later
/// commands.
class Fence {
  public:
    Fence() = default;
    /// Places the fence after all commands so far and flushes the commands to the GPU.
    explicit Fence(const Functions& gl);

    /// Returns when the GPU has reached the fence. Throws Error (kDevice) after ten minutes of
    /// waiting.
    void wait() const;

  private:
    struct Delete {
        const Functions* gl;
        void operator()(GLsync sync) const { gl->DeleteSync(sync); }
    };
    std::unique_ptr<std::remove_pointer_t<GLsync>, Delete> sync_;
};

/// A copy of a buffer in CPU-visible memory, which can be read while the GPU overwrites the buffer.
/// Grows on demand and is reused.
class ReadBack : public Object<&Functions::DeleteBuffers> {
  public:
    ReadBack() = default;
    /// Makes the GPU copy the first `bytes` of `from`. A barrier before the copy makes shaders'
    /// writes visible. The copy can be read after waiting for a later Fence. Throws Error (kMemory)
    /// if the driver runs out of memory.
    void copy(const Functions& gl, const Buffer& from, std::size_t bytes);

    template <class T>
    const T* as() const {
        return static_cast<const T*>(data_);
    }

  private:
    ReadBack(const Functions& gl, std::size_t bytes);

    std::size_t size_ = 0;
    const void* data_ = nullptr;
};

/// Returns a texture with immutable 2D storage.
Texture makeTexture2D(const Functions& gl, GLenum format, int width, int height, int levels = 1);

/// Returns a texture with immutable 2D storage and several samples per texel, at the same positions
/// in every texel.
Texture makeTexture2DMultisample(const Functions& gl, GLenum format, int samples, int width,
                                 int height);

/// Returns a texture array with immutable storage, without mipmaps.
Texture makeTexture2DArray(const Functions& gl, GLenum format, int width, int height, int layers);

/// Returns a cube map with immutable storage, `size` texels per side.
Texture makeTextureCube(const Functions& gl, GLenum format, int size, int levels);

/// Returns a framebuffer with these colour attachments (0, 1, …) and a depth attachment (0 = no
/// depth). Throws Error (kDevice) if the driver does not support the combination.
Framebuffer makeFramebuffer(const Functions& gl, const std::vector<GLuint>& colors, GLuint depth);

/// Returns a framebuffer without attachments, for passes that write only to storage buffers.
Framebuffer makeEmptyFramebuffer(const Functions& gl, int width, int height);

/// Waits until the GPU has finished all writes to buffers, and makes the writes visible to mappings
/// and later passes.
void waitForGpu(const Functions& gl);

/// Throws Error (kDevice) if the context was lost, (kMemory) on GL_OUT_OF_MEMORY, (kInternal) on
/// any other GL error. `stage` names the stage in the message.
void checkErrors(const Functions& gl, const std::string& stage);

/// The depth test. Z is reversed: nearer fragments have greater depths.
enum class DepthTest {
    kOff,
    kNearest,   ///< keeps the nearest fragment; among equal depths, the first drawn
    kFarthest,  ///< keeps the farthest fragment; among equal depths, the last drawn
    kReplace,   ///< every fragment passes and sets the depth
    kInFront    ///< rejects fragments behind the buffer's depth; writes no depth
};

/// Blending of a pass's output with a colour attachment. Colours are premultiplied.
enum class Blend : std::uint8_t {
    kOff,
    kMax,   ///< maximum of every component
    kAdd,   ///< sum
    kOver,  ///< over: dst = src + (1 − src.a)·dst
    /// Over, with opacity from the shader's second output: dst = src + (1 − src1)·dst.
    kOverByOpacity,
    kOverByItself,  ///< over, for opacity channels: dst = src + (1 − src)·dst
    kUnder,         ///< under: dst += (1 − dst.a)·src
};

/// The maximum number of colour attachments of a pass.
inline constexpr std::size_t kMaxAttachments = 8;

/// All fixed-function state that a geometry pass depends on. Every pass sets all of it, so that no
/// state is inherited from an earlier pass.
struct PassState {
    GLuint framebuffer = 0;
    int viewport_width = 0, viewport_height = 0;
    /// Scissor rectangle in pixels; y increases upwards.
    int scissor_x = 0, scissor_y = 0, scissor_width = 0, scissor_height = 0;
    DepthTest depth_test = DepthTest::kOff;
    /// Whether geometry in front of the near plane and behind the far plane is kept.
    bool depth_clamp = false;
    bool multisampled = false;  ///< whether the framebuffer has several samples per pixel
    std::array<Blend, kMaxAttachments> blend{};  ///< blending with each colour attachment
};
void apply(const Functions& gl, const PassState& state);

/// Clears the scissor rectangle of `state`: depths to 0, the far plane, and the first attachment to
/// (`red`, 0, 0, 0). The attachment must have unsigned integers.
void clear(const Functions& gl, PassState state, GLuint red = 0);

/// Enables or disables a capability.
inline void setEnabled(const Functions& gl, GLenum capability, bool on) {
    on ? gl.Enable(capability) : gl.Disable(capability);
}

}  // namespace peeler::gl
