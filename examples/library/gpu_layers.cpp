// SPDX-License-Identifier: Apache-2.0
// Draws a scene's layers from the buffers that peeler fills in the program's own GL context:
//     gpu_layers SCENE [PICTURE.png [FIRST [LAST]]]
// The picture shows the layers FIRST to LAST, counted from 0.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>
#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "headless_context.h"

// A triangle that covers the viewport.
constexpr const char* kVertexShader = R"(#version 450 core
void main() { gl_Position = vec4(ivec2(gl_VertexID % 2, gl_VertexID / 2) * 4 - 1, 0, 1); })";

// Composites layers front to back. A colour is four halfs. Row 0 of the target is the top row.
constexpr const char* kFragmentShader = R"(#version 450 core
layout(std430, binding = 0) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 1) readonly buffer Offsets { uint offsets[]; };
layout(std430, binding = 2) readonly buffer Depths { float depths[]; };
layout(std430, binding = 3) readonly buffer Colors { uvec2 colors[]; };
layout(location = 0) uniform ivec3 band;   // x0, y0, width
layout(location = 1) uniform uvec2 range;  // first layer; end
layout(location = 0) out vec4 color;
layout(location = 1) out float z;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - band.xy;
    uint pixel = uint(at.y * band.z + at.x);
    color = vec4(0);
    z = uintBitsToFloat(0x7F800000u);  // infinity
    for (uint k = range.x; k < min(counts[pixel], range.y); ++k) {
        uint i = offsets[pixel] + k;
        vec4 layer = vec4(unpackHalf2x16(colors[i].x), unpackHalf2x16(colors[i].y));
        color += (1 - color.a) * layer;
        if (k == range.x) z = depths[i];
    }
})";

GLuint makeProgram() {
    const GLuint program = glCreateProgram();
    for (const auto& [stage, text] : {std::pair{GL_VERTEX_SHADER, kVertexShader},
                                      std::pair{GL_FRAGMENT_SHADER, kFragmentShader}}) {
        const GLuint shader = glCreateShader(stage);
        glShaderSource(shader, 1, &text, nullptr);
        glCompileShader(shader);
        glAttachShader(program, shader);
        glDeleteShader(shader);
    }
    glLinkProgram(program);
    return program;
}

/// A picture drawn with GL: colours and Z.
class Picture {
  public:
    explicit Picture(const peeler::Window& window) : window_(window) {
        glCreateTextures(GL_TEXTURE_2D, 2, textures_);
        glTextureStorage2D(textures_[0], 1, GL_RGBA32F, window.x1, window.y1);
        glTextureStorage2D(textures_[1], 1, GL_R32F, window.x1, window.y1);
        glCreateFramebuffers(1, &framebuffer_);
        const GLenum targets[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
        for (int i = 0; i < 2; ++i)
            glNamedFramebufferTexture(framebuffer_, targets[i], textures_[i], 0);
        glNamedFramebufferDrawBuffers(framebuffer_, 2, targets);
        glCreateVertexArrays(1, &no_vertices_);
        program_ = makeProgram();
    }

    /// Draws layers of a band. peeler's buffers need no memory barrier.
    void draw(const peeler::GlLayers& band, unsigned first, unsigned end) const {
        const peeler::Window& rows = band.window;
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
        glViewport(rows.x0, rows.y0, rows.width(), rows.height());
        const GLuint buffers[] = {band.counts, band.offsets, band.depths, band.colors};
        glBindBuffersBase(GL_SHADER_STORAGE_BUFFER, 0, 4, buffers);
        glProgramUniform3i(program_, 0, rows.x0, rows.y0, rows.width());
        glProgramUniform2ui(program_, 1, first, end);
        glUseProgram(program_);
        glBindVertexArray(no_vertices_);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }

    std::vector<float> colors() const { return read(0, GL_RGBA, 4); }
    std::vector<float> depths() const { return read(1, GL_RED, 1); }

  private:
    std::vector<float> read(int texture, GLenum format, std::size_t components) const {
        std::vector<float> values(window_.pixels() * components);
        glGetTextureSubImage(textures_[texture], 0, window_.x0, window_.y0, 0, window_.width(),
                             window_.height(), 1, format, GL_FLOAT,
                             static_cast<GLsizei>(values.size() * sizeof(float)), values.data());
        return values;
    }

    peeler::Window window_;
    GLuint textures_[2] = {}, framebuffer_ = 0, no_vertices_ = 0, program_ = 0;
};

/// Returns the largest difference between colour components; infinity if a Z differs.
float difference(const Picture& picture, const peeler::CompositeImage& composite) {
    if (picture.depths() != composite.z) return INFINITY;
    const std::vector<float> colors = picture.colors();
    float largest = 0;
    for (std::size_t i = 0; i < colors.size(); ++i)
        largest = std::max(largest, std::abs(colors[i] - composite.rgba[i / 4][i % 4]));
    return largest;
}

/// Writes a picture, as an image with one layer.
void write(const char* path, const peeler::View& view, const Picture& picture) {
    const std::vector<float> colors = picture.colors(), depths = picture.depths();
    peeler::StoredLayers stored;
    peeler::LayeredImage& image = stored.image;
    image.window = view.crop;
    image.color = {peeler::colorNames(false), peeler::PixelType::kFloat, {}};
    image.color.data.resize(colors.size() * sizeof(float));
    image.offsets = {0};
    for (std::size_t pixel = 0; pixel < depths.size(); ++pixel) {
        if (std::isfinite(depths[pixel])) {
            std::copy_n(&colors[4 * pixel], 4, &image.color.as<float>()[4 * image.z.size()]);
            image.z.push_back(depths[pixel]);
        }
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
    image.color.data.resize(image.fragments() * image.color.stride());
    stored.plan.view = view;
    stored.plan.color_type = image.color.type;
    stored.plan.layers = {{view.crop, image.fragments()}};
    stored.plan.fragments_counted = stored.plan.fragments_stored = image.fragments();
    peeler::writeLayers(path, stored);
}

int drawLayers(int count, char** arguments) {
    peeler::RendererOptions options;
    options.adopt = [](const char* name) {
        return reinterpret_cast<void*>(eglGetProcAddress(name));
    };
    peeler::Renderer renderer(options);
    peeler::Shown shown{peeler::readScene(arguments[1])};
    shown.colored_glass = false;  // to get four components per colour: R, G, B, A
    peeler::CameraChoice camera;
    camera.size = {640, 360};
    const peeler::View view = peeler::viewOf(shown, camera);
    const unsigned first = count > 3 ? static_cast<unsigned>(std::atoi(arguments[3])) : 0;
    const unsigned end = count > 4 ? static_cast<unsigned>(std::atoi(arguments[4])) + 1 : ~0U;

    const Picture all(view.crop), some(view.crop);
    unsigned layers = 0, bands = 0;
    peeler::CaptureSettings settings;
    settings.band_bytes = 8 << 20;  // small, so that there are several bands
    for (peeler::GlLayers band = renderer.glLayers(shown, view, settings); !band.window.empty();
         band = renderer.nextGlLayers()) {
        all.draw(band, 0, ~0U);
        some.draw(band, first, end);
        layers = std::max(layers, band.layers);
        ++bands;
    }
    if (count > 2) write(arguments[2], view, some);
    const float off = difference(all, renderer.composite(shown, view));
    std::printf("%u layers in %u bands; all layers differ from peeler's composite by %g\n", layers,
                bands, static_cast<double>(off));
    return off < 1e-6F ? 0 : 1;
}

int main(int count, char** arguments) try {
    if (count < 2) return 2;
    const HeadlessContext context;
    if (!context.isCurrent()) {
        std::fprintf(stderr, "there is no OpenGL 4.5\n");
        return 5;
    }
    return drawLayers(count, arguments);
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
