// SPDX-License-Identifier: Apache-2.0
// Move-only owners of GL objects, and the state of a pass.
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

/// Owns one GL name; `Delete` is the member of Functions that frees it. Must not outlive the
/// context.
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

/// Immutable storage of a fixed size, in the GPU's memory where there is one; the CPU gets at it by
/// mapping.
class Buffer : public Object<&Functions::DeleteBuffers> {
  public:
    /// A mapped range; unmapped with the object. No GPU command may use the buffer while it lives.
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
    /// Throws Error (kMemory) if the driver has no room.
    Buffer(const Functions& gl, std::size_t bytes);

    std::size_t size() const { return size_; }
    /// The first `bytes`, for reading (after waitForGpu), or for overwriting: then all that the
    /// buffer holds is lost. Commands that still read it need not be waited for: a driver gives the
    /// buffer other memory, or waits itself.
    Mapping read(std::size_t bytes) const;
    Mapping overwrite(std::size_t bytes) const;
    /// Sets the first `bytes` to 0, on the GPU.
    void clearToZero(std::size_t bytes) const;
    void bindStorage(unsigned binding) const;
    void bindUniform(unsigned binding, std::size_t offset, std::size_t bytes) const;

  private:
    std::size_t size_ = 0;
};

/// A place among the commands of a context, which can be waited for while the GPU goes on with
/// those behind it.
class Fence {
  public:
    Fence() = default;
    /// Behind all commands until now, which are sent to the GPU.
    explicit Fence(const Functions& gl);

    /// Returns when the GPU has come there. Throws Error (kDevice) if it never does.
    void wait() const;

  private:
    struct Delete {
        const Functions* gl;
        void operator()(GLsync sync) const { gl->DeleteSync(sync); }
    };
    std::unique_ptr<std::remove_pointer_t<GLsync>, Delete> sync_;
};

/// A copy of a buffer in memory that the CPU sees at all times, so that it can be read while the
/// GPU writes to the buffer anew. Grown on demand, reused.
class ReadBack : public Object<&Functions::DeleteBuffers> {
  public:
    ReadBack() = default;
    /// Has the GPU copy the first `bytes`, as shaders have left them: a barrier is set before. They
    /// can be read once a Fence behind this has been waited for. Throws Error (kMemory) if the
    /// driver has no room.
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

/// A texture with immutable 2D storage.
Texture makeTexture2D(const Functions& gl, GLenum format, int width, int height, int levels = 1);

/// The same, an array of layers without mipmaps.
Texture makeTexture2DArray(const Functions& gl, GLenum format, int width, int height, int layers);

/// A cube map with immutable storage, `size` texels a side.
Texture makeTextureCube(const Functions& gl, GLenum format, int size, int levels);

/// A framebuffer with these colour attachments (0, 1, …) and, if not zero, a depth attachment.
/// Throws Error (kDevice) if the driver does not take the combination.
Framebuffer makeFramebuffer(const Functions& gl, const std::vector<GLuint>& colors, GLuint depth);

/// A framebuffer without any attachment, for passes that write to storage buffers only.
Framebuffer makeEmptyFramebuffer(const Functions& gl, int width, int height);

/// Makes what the GPU wrote to buffers visible to mappings and later passes, and waits until it is.
void waitForGpu(const Functions& gl);

/// Throws Error (kDevice) if the context was lost, (kMemory) on GL_OUT_OF_MEMORY, (kInternal) on
/// any other GL error. `stage` says where in the message.
void checkErrors(const Functions& gl, const std::string& stage);

/// Which fragment a depth buffer keeps. Reversed Z: nearer is greater.
enum class DepthTest {
    kOff,
    kNearest,   ///< the first drawn among equals
    kFarthest,  ///< the last drawn among equals
    kReplace,   ///< whatever is drawn
    kInFront    ///< none: what is behind what it holds fails, and what it holds stays
};

/// How what a pass writes meets what a colour attachment holds. Colours are premultiplied.
enum class Blend : std::uint8_t {
    kOff,
    kMax,            ///< every component keeps its largest value
    kAdd,            ///< sums
    kOver,           ///< in front of what is there: dst = src + (1 − src.a)·dst
    kOverByOpacity,  ///< likewise by the shader's second output: dst = src + (1 − src1)·dst
    kOverByItself,   ///< likewise, of opacities: dst = src + (1 − src)·dst
    kUnder,          ///< behind what is there: dst += (1 − dst.a)·src
};

/// The most colour attachments a pass of peeler's has.
inline constexpr std::size_t kMaxAttachments = 5;

/// All fixed-function state a geometry pass depends on. Set as a whole, so that nothing is
/// inherited.
struct PassState {
    GLuint framebuffer = 0;
    int viewport_width = 0, viewport_height = 0;
    int scissor_x = 0, scissor_y = 0, scissor_width = 0, scissor_height = 0;  ///< y up
    DepthTest depth_test = DepthTest::kOff;
    bool depth_clamp = false;  ///< what lies before the near or behind the far plane counts, too
    std::array<Blend, kMaxAttachments> blend{};  ///< by attachment
};
/// Sets all of it.
void apply(const Functions& gl, const PassState& state);

}  // namespace peeler::gl
