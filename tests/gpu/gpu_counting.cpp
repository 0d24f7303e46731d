// SPDX-License-Identifier: Apache-2.0
// Benchmark of counting fragments, with panes that cover the picture and with many small triangles:
// - buffer: atomicAdd on a storage buffer with the pixels row by row, as in peeler
// - tiles: atomicAdd on a storage buffer with the pixels in squares of 8 × 8
// - image: imageAtomicAdd on an R32UI image
// - interlock: load and store on the R32UI image, ordered by ARB_fragment_shader_interlock
// - blending: adds 1 to an R32F target, which is exact below 2^24
#include <dlfcn.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>

#include "core/gl/objects.h"
#include "gpu/gpu_choices.h"

namespace peeler::benchmark {
namespace {

/// A test scene: the triangles cover the picture, or are scattered in it.
struct Triangles {
    const char* name;
    int count;
    const char* vertex_shader;
};

constexpr Triangles kTriangles[] = {
    {"panes", 32, R"(
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);
})"},
    {"triangles", 100'000, R"(
uint random(uint n) {  // PCG (O'Neill 2014), by its permutation of a counter
    uint state = n * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
void main() {
    uint first = random(uint(gl_InstanceID));
    vec2 centre = vec2(first & 0xFFFFu, first >> 16u) / 32768.0 - 1.0;
    float turn = float(random(first) & 0xFFFFu) / 65536.0 + float(gl_VertexID) / 3.0;
    gl_Position = vec4(centre + vec2(9.0, 16.0) / 640.0 * sin(6.2831853 * vec2(turn, turn + 0.25)), 0, 1);
})"},
};

/// The storage of the counts.
enum class Counts { kBuffer, kTiles, kImage, kTarget };

struct Way {
    const char* name;
    Counts counts;
    const char* extension;  ///< required extension, or ""
    const char* fragment_shader;
};

constexpr Way kWays[] = {
    {"buffer", Counts::kBuffer, "", R"(
layout(std430, binding = 0) buffer Counts { uint counts[]; };
void main() { atomicAdd(counts[uint(gl_FragCoord.y) * WIDTH + uint(gl_FragCoord.x)], 1u); })"},
    {"tiles", Counts::kTiles, "", R"(
layout(std430, binding = 0) buffer Counts { uint counts[]; };
void main() { atomicAdd(counts[placeInTiles(uvec2(gl_FragCoord.xy))], 1u); })"},
    {"image", Counts::kImage, "", R"(
layout(r32ui, binding = 0) uniform uimage2D counts;
void main() { imageAtomicAdd(counts, ivec2(gl_FragCoord.xy), 1u); })"},
    {"interlock", Counts::kImage, "GL_ARB_fragment_shader_interlock", R"(
layout(r32ui, binding = 0) uniform coherent uimage2D counts;
layout(pixel_interlock_unordered) in;
void main() {
    beginInvocationInterlockARB();
    imageStore(counts, ivec2(gl_FragCoord.xy), imageLoad(counts, ivec2(gl_FragCoord.xy)) + 1u);
    endInvocationInterlockARB();
})"},
    {"blending", Counts::kTarget, "", R"(
layout(location = 0) out float one;
void main() { one = 1.0; })"},
};

/// Returns the first lines of the counting shaders: the extension of this way, and pixel addresses.
std::string beginningOf(const Settings& settings, const Way& way) {
    std::string text;
    if (*way.extension) text += std::string("#extension ") + way.extension + " : require\n";
    text += "const uint WIDTH = " + std::to_string(settings.width) + "u;\n";
    return text +
           "uint placeInTiles(uvec2 at) {\n"
           "    uvec2 tile = at / 8u, inside = at % 8u;\n"
           "    return (tile.y * ((WIDTH + 7u) / 8u) + tile.x) * 64u + inside.y * 8u + inside.x;\n"
           "}\n";
}

/// Returns glBindImageTexture, which peeler itself does not use.
PFNGLBINDIMAGETEXTUREPROC bindImageTexture() {
    void* const library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    using ProcAddress = void* (*)(const char*);
    const auto lookup =
        library ? reinterpret_cast<ProcAddress>(dlsym(library, "eglGetProcAddress")) : nullptr;
    if (!lookup) throw std::runtime_error("there is no libEGL.so.1");
    return reinterpret_cast<PFNGLBINDIMAGETEXTUREPROC>(lookup("glBindImageTexture"));
}

/// The storage of each way, and its counting pass.
class Counter {
  public:
    Counter(const gl::Functions& gl, const Settings& settings)
        : gl_(gl),
          settings_(settings),
          buffer_(gl, wholeTiles(settings.width) * wholeTiles(settings.height) * 64 *
                          sizeof(std::uint32_t)),
          image_(gl::makeTexture2D(gl, GL_R32UI, settings.width, settings.height)),
          target_(gl::makeTexture2D(gl, GL_R32F, settings.width, settings.height)),
          of_image_(gl::makeFramebuffer(gl, {image_.name()}, 0)),
          of_target_(gl::makeFramebuffer(gl, {target_.name()}, 0)),
          empty_(gl::makeEmptyFramebuffer(gl, settings.width, settings.height)),
          bind_image_(bindImageTexture()) {
        GLuint arrays = 0;
        gl.CreateVertexArrays(1, &arrays);
        vertices_ = gl::VertexArray(gl, arrays);
    }

    /// Runs a counting pass. Returns its time in milliseconds. Stores the counts in `counts`, row
    /// by row.
    double time(const Way& way, const Triangles& triangles, std::vector<std::uint32_t>& counts) {
        const Shaders shaders(gl_, beginningOf(settings_, way),
                              {{GL_VERTEX_SHADER, triangles.vertex_shader},
                               {GL_FRAGMENT_SHADER, way.fragment_shader}});
        shaders.use();
        bind(way);
        const double taken = milliseconds(
            settings_, [&] { clear(); },
            [&] {
                gl_.DrawArraysInstanced(GL_TRIANGLES, 0, 3, triangles.count);
                gl_.Finish();
            });
        read(way, counts);
        gl::checkErrors(gl_, std::string("counting by ") + way.name);
        return taken;
    }

  private:
    static std::size_t wholeTiles(int pixels) { return static_cast<std::size_t>(pixels + 7) / 8; }

    void bind(const Way& way) {
        buffer_.bindStorage(0);
        bind_image_(0, image_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32UI);
        gl_.BindVertexArray(vertices_.name());
        gl::PassState state;
        const bool blends = way.counts == Counts::kTarget;
        state.framebuffer = blends ? of_target_.name() : empty_.name();
        state.viewport_width = state.scissor_width = settings_.width;
        state.viewport_height = state.scissor_height = settings_.height;
        if (blends) state.blend[0] = gl::Blend::kAdd;
        gl::apply(gl_, state);
    }

    void clear() {
        constexpr GLuint kZero[4] = {};
        constexpr GLfloat kNothing[4] = {};
        gl_.MemoryBarrier(GL_ALL_BARRIER_BITS);
        buffer_.clearToZero(buffer_.size());
        gl_.ClearNamedFramebufferuiv(of_image_.name(), GL_COLOR, 0, kZero);
        gl_.ClearNamedFramebufferfv(of_target_.name(), GL_COLOR, 0, kNothing);
        gl_.MemoryBarrier(GL_ALL_BARRIER_BITS);
        gl_.Finish();
    }

    void read(const Way& way, std::vector<std::uint32_t>& counts) {
        gl_.MemoryBarrier(GL_ALL_BARRIER_BITS);
        gl::waitForGpu(gl_);
        counts.resize(settings_.pixels());
        const auto bytes = static_cast<GLsizei>(counts.size() * sizeof(std::uint32_t));
        const auto width = static_cast<std::size_t>(settings_.width);
        if (way.counts == Counts::kImage) {
            gl_.GetTextureSubImage(image_.name(), 0, 0, 0, 0, settings_.width, settings_.height, 1,
                                   GL_RED_INTEGER, GL_UNSIGNED_INT, bytes, counts.data());
        } else if (way.counts == Counts::kTarget) {
            std::vector<float> sums(counts.size());
            gl_.GetTextureSubImage(target_.name(), 0, 0, 0, 0, settings_.width, settings_.height, 1,
                                   GL_RED, GL_FLOAT, bytes, sums.data());
            std::ranges::transform(sums, counts.begin(),
                                   [](float sum) { return static_cast<std::uint32_t>(sum); });
        } else {
            const auto mapping = buffer_.read(buffer_.size());
            const auto* const found = mapping.as<const std::uint32_t>();
            for (std::size_t i = 0; i < counts.size(); ++i) {
                const std::size_t x = i % width, y = i / width;
                const std::size_t tile = y / 8 * wholeTiles(settings_.width) + x / 8;
                counts[i] = found[way.counts == Counts::kTiles ? tile * 64 + y % 8 * 8 + x % 8 : i];
            }
        }
    }

    const gl::Functions& gl_;
    const Settings& settings_;
    gl::Buffer buffer_;
    gl::Texture image_, target_;
    gl::Framebuffer of_image_, of_target_, empty_;
    gl::VertexArray vertices_;
    PFNGLBINDIMAGETEXTUREPROC bind_image_;
};

}  // namespace

Json counting(const gl::Functions& gl, const Settings& settings) {
    Counter counter(gl, settings);
    Json result;
    for (const Triangles& triangles : kTriangles) {
        Json& row = result[triangles.name] = {{"fragments", 0}};
        std::vector<std::uint32_t> expected, counts;
        for (const Way& way : kWays) {
            if (*way.extension && !gl::hasExtension(gl, way.extension)) {
                row[way.name] = nullptr;
                continue;
            }
            row[way.name] = counter.time(way, triangles, counts);
            if (expected.empty()) {
                expected = counts;
                row["fragments"] = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
            } else if (counts != expected) {
                throw std::runtime_error(std::string("other counts by ") + way.name + " of " +
                                         triangles.name);
            }
        }
    }
    return result;
}

}  // namespace peeler::benchmark
