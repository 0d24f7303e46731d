// SPDX-License-Identifier: Apache-2.0
// Tests rendering in a borrowed GL context: with a harmful value in each row of the state table,
// with unusable states, and without a current context.
#include "core/gl/borrowed_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <peeler/error.h>
#include <peeler/image_sink.h>
#include <peeler/renderer.h>
#include "support/borrowed_context.h"
#include "support/capture.h"
#include "support/method_names.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Values = std::vector<double>;

template <class Function>
Function function(const char* name) {
    return reinterpret_cast<Function>(functionOf(name));
}

/// The host: its context, which is current on this thread, and its objects.
struct Host {
    std::unique_ptr<gl::Context> context = gl::createContext({.backend = testBackend()});
    const gl::Functions& gl = context->functions();

    int integer(GLenum parameter) const {
        std::array<GLint, 4> value{};
        gl.GetIntegerv(parameter, value.data());
        return value[0];
    }
    GLuint count(GLenum parameter) const { return static_cast<GLuint>(integer(parameter)); }

    GLuint buffer() const {
        GLuint name = 0;
        gl.CreateBuffers(1, &name);
        gl.NamedBufferStorage(name, kBytes, nullptr, GL_MAP_READ_BIT);
        return name;
    }
    GLuint texture(GLenum target) const {
        GLuint name = 0;
        gl.CreateTextures(target, 1, &name);
        gl.TextureStorage2D(name, 1, GL_RGBA8, 1, 1);
        return name;
    }
    GLuint sampler() const {
        GLuint name = 0;
        gl.CreateSamplers(1, &name);
        gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        gl.SamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_MIRRORED_REPEAT);
        return name;
    }
    GLuint framebuffer() const {
        GLuint name = 0;
        gl.CreateFramebuffers(1, &name);
        gl.NamedFramebufferTexture(name, GL_COLOR_ATTACHMENT0, texture(GL_TEXTURE_2D), 0);
        return name;
    }
    GLuint vertexArray() const {
        GLuint name = 0;
        gl.CreateVertexArrays(1, &name);
        return name;
    }
    /// Returns a program for transform feedback: its vertex shader has an output `place`.
    GLuint program() const {
        const GLuint shader = gl.CreateShader(GL_VERTEX_SHADER);
        const char* text =
            "#version 450 core\nout vec4 place;\n"
            "void main() { place = vec4(1.0); gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n";
        gl.ShaderSource(shader, 1, &text, nullptr);
        gl.CompileShader(shader);
        const GLuint name = gl.CreateProgram();
        gl.AttachShader(name, shader);
        const char* captured = "place";
        function<PFNGLTRANSFORMFEEDBACKVARYINGSPROC>("glTransformFeedbackVaryings")(
            name, 1, &captured, GL_INTERLEAVED_ATTRIBS);
        gl.LinkProgram(name);
        return name;
    }

    static constexpr GLsizeiptr kBytes = 4096;
};

/// Returns a scene with layers of glass, metal in an environment, a texture with rows of odd
/// length, a culled face, a mirrored face, points and lines.
std::shared_ptr<const Scene> makeScene() {
    SceneBuilder builder;
    const int textured = builder.lit(builder.material({1, 0.8, 0.6, 0.6}));
    const int metal = builder.lit(builder.material({0.9, 0.7, 0.3, 1}, AlphaMode::kOpaque, false));
    const int front = builder.material({0.1, 0.4, 0.9, 0.5}, AlphaMode::kBlend, false);
    const int thin = builder.material({1, 1, 0, 1}, AlphaMode::kOpaque);
    builder.sphere({-0.4, 0, -2.5}, 0.7F, textured);
    builder.sphere({0.5, 0.1, -2.6}, 0.7F, metal);
    builder.rectangle(0.5F, 0.3F, -1.4F, front);
    builder.rectangle(2.0F, 1.0F, -4.0F, metal);
    glm::dmat4 mirrored(1);
    mirrored[0][0] = -1;
    builder.quad({0, -0.4, -1.8}, {0.6, -0.4, -1.8}, {0.6, 0.2, -1.8}, {0, 0.2, -1.8}, front,
                 mirrored);
    builder.light({}, glm::dmat4(1));
    Scene& scene = builder.scene();
    for (const Topology topology : {Topology::kPoints, Topology::kLines, Topology::kLineStrip}) {
        Primitive& p = scene.meshes[2].primitives.emplace_back();
        p.topology = topology;
        p.material = thin;
        const float y = 0.1F * static_cast<float>(topology);
        p.positions = {{-0.3, y, -1.2}, {0.3, y + 0.1F, -1.2}, {0.1, y - 0.3F, -1.3}, {0, 0, -1.2}};
        p.colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}, {1, 1, 1, 1}};
        p.indices = {0, 1, 2, 3};
    }
    Image image{"", 5, 3, {}};
    for (int i = 0; i < 5 * 3 * 4; ++i)
        image.rgba.push_back(static_cast<std::uint8_t>(i * 37 + 90));
    scene.images.push_back(image);
    Material& m = scene.materials[static_cast<std::size_t>(textured)];
    m.base_color_texture.image = 0;
    scene.materials[static_cast<std::size_t>(metal)].metallic = 1;
    scene.materials[static_cast<std::size_t>(metal)].roughness = 0.3F;
    Environment& environment = scene.environment.emplace();
    environment.width = 8;
    environment.height = 4;
    for (int i = 0; i < 8 * 4; ++i)
        environment.radiance.emplace_back(i % 3, i % 5 == 0 ? 4 : 0.1, i % 2);
    return std::make_shared<const Scene>(scene);
}

/// Pictures of a new scene by a Renderer, and the GL state during the first picture.
struct Pictures {
    std::vector<LayeredImage> layers;
    std::vector<CompositeImage> composites;
    Values state;
};

class WatchingSink final : public Sink {
  public:
    explicit WatchingSink(std::function<void()> begun) : begun_(std::move(begun)) {}
    void begin(const Plan& plan) override {
        begun_();
        inner_.begin(plan);
    }
    void write(LayeredImage&& band) override { inner_.write(std::move(band)); }
    void finish() override { inner_.finish(); }
    LayeredImage& image() { return inner_.image; }

  private:
    std::function<void()> begun_;
    ImageSink inner_;
};

Pictures render(Renderer& renderer, const std::function<Values()>& state = {}) {
    Pictures pictures;
    const Shown shown{makeScene()};
    const View view = testView(48, 36);
    CaptureSettings settings;
    settings.point_size = 3;
    settings.shadows = true;
    settings.shadow_size = 64;
    settings.channels = {Channel::kNormal, Channel::kId};
    WatchingSink sink([&] {
        if (state) pictures.state = state();
    });
    renderer.capture(shown, view, settings, sink);
    pictures.layers.push_back(std::move(sink.image()));
    settings.channels.clear();
    settings.method = methodNames(true).back();
    pictures.layers.push_back(renderer.layers(shown, view, settings));
    const Bundle bundle =
        parallelBundle("down", *boundsOf(shown), *boundsOf(shown), {0, 0, -1}, {.resolution = 24});
    pictures.layers.push_back(renderer.rays(shown, bundle, raySettings(), RayEngine::kGl));
    for (const std::string& method : methodNames(false)) {
        settings.method = method;
        pictures.composites.push_back(renderer.composite(shown, view, settings));
    }
    return pictures;
}

/// Returns the pictures made in a context of our own.
const Pictures& expected() {
    static const Pictures pictures = [] {
        RendererOptions options;
        options.backend = testBackend();
        Renderer renderer(options);
        return render(renderer);
    }();
    return pictures;
}

void expectExpected(const Pictures& pictures, const std::string& where) {
    ASSERT_EQ(pictures.layers.size(), expected().layers.size());
    for (std::size_t i = 0; i < pictures.layers.size(); ++i)
        EXPECT_EQ(difference(pictures.layers[i], expected().layers[i]), "")
            << where << ", image " << i;
    for (std::size_t i = 0; i < pictures.composites.size(); ++i) {
        EXPECT_TRUE(pictures.composites[i].rgba == expected().composites[i].rgba)
            << where << ", composite " << i;
        EXPECT_TRUE(pictures.composites[i].z == expected().composites[i].z)
            << where << ", Z of composite " << i;
    }
}

/// The most harmful value for a row of the state table: functions to set it, and to read it
/// independently of the table.
struct Hostile {
    std::string name;
    std::function<void(const Host&)> set;
    std::function<Values(const Host&)> read;
    /// whether peeler's passes may set this value themselves
    bool set_by_passes = false;
};

Hostile enabled(const std::string& name, GLenum capability,
                const std::function<void(const Host&)>& besides = {}) {
    return {name,
            [=](const Host& host) {
                if (host.gl.IsEnabled(capability))
                    host.gl.Disable(capability);
                else
                    host.gl.Enable(capability);
                if (besides) besides(host);
            },
            [=](const Host& host) { return Values{double(host.gl.IsEnabled(capability))}; }};
}

/// Returns the row for a parameter that is a single number.
Hostile number(const std::string& name, GLenum parameter, std::function<void(const Host&)> set) {
    return {name, std::move(set), [=](const Host& host) {
                std::array<GLdouble, 16> values{};
                host.gl.GetDoublev(parameter, values.data());
                return Values{values[0]};
            }};
}

Hostile setByPasses(Hostile hostile) {
    hostile.set_by_passes = true;
    return hostile;
}

Hostile pixelStore(const std::string& name, GLenum parameter, GLint value) {
    return number(name, parameter,
                  [=](const Host& host) { host.gl.PixelStorei(parameter, value); });
}

/// Returns a reader of indexed state: reads `numbers` numbers of each parameter, at every index
/// below `limit`.
std::function<Values(const Host&)> byIndex(const std::vector<GLenum>& parameters, GLenum limit,
                                           std::size_t numbers) {
    return [=](const Host& host) {
        Values values;
        for (GLuint i = 0; i < host.count(limit); ++i) {
            for (const GLenum parameter : parameters) {
                std::array<GLint, 4> one{};
                host.gl.GetIntegeri_v(parameter, i, one.data());
                values.insert(values.end(), one.begin(),
                              one.begin() + static_cast<std::ptrdiff_t>(numbers));
            }
        }
        return values;
    };
}

template <class Each>
void eachIndex(const Host& host, GLenum limit, Each each) {
    for (GLuint i = 0; i < host.count(limit); ++i)
        each(i);
}

Hostile bufferTarget(const std::string& name, GLenum target, GLenum binding) {
    return number(name, binding,
                  [=](const Host& host) { host.gl.BindBuffer(target, host.buffer()); });
}

Hostile bufferIndices(const std::string& name, GLenum target, GLenum limit, GLenum binding,
                      GLenum start, GLenum size) {
    return {name,
            [=](const Host& host) {
                const GLuint whole = host.buffer();
                eachIndex(host, limit, [&](GLuint i) {
                    if (i % 2 == 0)
                        host.gl.BindBufferBase(target, i, whole);
                    else
                        host.gl.BindBufferRange(target, i, host.buffer(), 1024, 256);
                });
                host.gl.BindBuffer(target, 0);
            },
            [=](const Host& host) {
                Values values = byIndex({binding}, limit, 1)(host);
                eachIndex(host, limit, [&](GLuint i) {
                    for (const GLenum parameter : {start, size}) {
                        GLint64 value = 0;
                        host.gl.GetInteger64i_v(parameter, i, &value);
                        values.push_back(static_cast<double>(value));
                    }
                });
                return values;
            }};
}

Values boundToUnits(const Host& host, const std::vector<GLenum>& bindings) {
    Values values;
    const int active = host.integer(GL_ACTIVE_TEXTURE);
    eachIndex(host, GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, [&](GLuint unit) {
        host.gl.ActiveTexture(GL_TEXTURE0 + unit);
        for (const GLenum binding : bindings)
            values.push_back(host.integer(binding));
    });
    host.gl.ActiveTexture(static_cast<GLenum>(active));
    return values;
}

std::vector<Hostile> hostileStates() {
    std::vector<Hostile> rows = {
        enabled("rasterizer discard", GL_RASTERIZER_DISCARD),
        enabled("primitive restart", GL_PRIMITIVE_RESTART,
                [](const Host&) {
                    function<PFNGLPRIMITIVERESTARTINDEXPROC>("glPrimitiveRestartIndex")(2);
                }),
        enabled("primitive restart, fixed index", GL_PRIMITIVE_RESTART_FIXED_INDEX),
        {"clip distances",
         [](const Host& host) {
             for (GLenum i = 0; i < 8; i += 2)
                 host.gl.Enable(GL_CLIP_DISTANCE0 + i);
         },
         [](const Host& host) {
             Values values;
             for (GLenum i = 0; i < 8; ++i)
                 values.push_back(host.gl.IsEnabled(GL_CLIP_DISTANCE0 + i));
             return values;
         }},
        number("provoking vertex", GL_PROVOKING_VERTEX,
               [](const Host& host) { host.gl.ProvokingVertex(GL_FIRST_VERTEX_CONVENTION); }),
        {"clip control",
         [](const Host& host) { host.gl.ClipControl(GL_UPPER_LEFT, GL_NEGATIVE_ONE_TO_ONE); },
         [](const Host& host) {
             return Values{double(host.integer(GL_CLIP_ORIGIN)),
                           double(host.integer(GL_CLIP_DEPTH_MODE))};
         }},
        enabled("depth clamp", GL_DEPTH_CLAMP),
        {"viewports",
         [](const Host& host) {
             eachIndex(host, GL_MAX_VIEWPORTS, [&](GLuint i) {
                 host.gl.ViewportIndexedf(i, 1, 2, 3, static_cast<GLfloat>(4 + i));
             });
         },
         byIndex({GL_VIEWPORT}, GL_MAX_VIEWPORTS, 4)},
        {"depth ranges",
         [](const Host& host) {
             eachIndex(host, GL_MAX_VIEWPORTS,
                       [&](GLuint i) { host.gl.DepthRangeIndexed(i, 0.75, 0.25 + 0.01 * i); });
         },
         [](const Host& host) {
             Values values;
             eachIndex(host, GL_MAX_VIEWPORTS, [&](GLuint i) {
                 std::array<GLdouble, 2> range{};
                 host.gl.GetDoublei_v(GL_DEPTH_RANGE, i, range.data());
                 values.insert(values.end(), range.begin(), range.end());
             });
             return values;
         }},
        enabled("program point size", GL_PROGRAM_POINT_SIZE),
        number("point size", GL_POINT_SIZE, [](const Host& host) { host.gl.PointSize(7); }),
        number("minimum sample shading", GL_MIN_SAMPLE_SHADING_VALUE,
               [](const Host& host) { host.gl.MinSampleShading(0.25F); }),
        number("line width", GL_LINE_WIDTH, [](const Host& host) { host.gl.LineWidth(5); }),
        enabled("line smooth", GL_LINE_SMOOTH),
        enabled("polygon smooth", GL_POLYGON_SMOOTH),
        number("polygon mode", GL_POLYGON_MODE,
               [](const Host& host) { host.gl.PolygonMode(GL_FRONT_AND_BACK, GL_LINE); }),
    };
    const auto offset = [](const Host&) {
        function<PFNGLPOLYGONOFFSETPROC>("glPolygonOffset")(3, 100000);
    };
    rows.insert(
        rows.end(),
        {enabled("polygon offset, fill", GL_POLYGON_OFFSET_FILL, offset),
         enabled("polygon offset, line", GL_POLYGON_OFFSET_LINE, offset),
         enabled("polygon offset, point", GL_POLYGON_OFFSET_POINT, offset),
         setByPasses(enabled("cull face", GL_CULL_FACE,
                             [](const Host& host) { host.gl.CullFace(GL_FRONT_AND_BACK); })),
         number("cull face mode", GL_CULL_FACE_MODE,
                [](const Host& host) { host.gl.CullFace(GL_FRONT_AND_BACK); }),
         setByPasses(number("front face", GL_FRONT_FACE,
                            [](const Host& host) { host.gl.FrontFace(GL_CW); })),
         enabled("conservative rasterization, NVIDIA", GL_CONSERVATIVE_RASTERIZATION_NV),
         enabled("conservative rasterization, Intel", GL_CONSERVATIVE_RASTERIZATION_INTEL),
         enabled("shading rate image", GL_SHADING_RATE_IMAGE_NV),
         setByPasses(enabled("multisample", GL_MULTISAMPLE)),
         enabled("sample alpha to coverage", GL_SAMPLE_ALPHA_TO_COVERAGE),
         enabled("sample alpha to one", GL_SAMPLE_ALPHA_TO_ONE),
         enabled(
             "sample coverage", GL_SAMPLE_COVERAGE,
             [](const Host&) { function<PFNGLSAMPLECOVERAGEPROC>("glSampleCoverage")(0, false); }),
         enabled("sample mask", GL_SAMPLE_MASK,
                 [](const Host&) { function<PFNGLSAMPLEMASKIPROC>("glSampleMaski")(0, 0); }),
         enabled("sample shading", GL_SAMPLE_SHADING),
         number("derivative hint", GL_FRAGMENT_SHADER_DERIVATIVE_HINT,
                [](const Host& host) {
                    host.gl.Hint(GL_FRAGMENT_SHADER_DERIVATIVE_HINT, GL_FASTEST);
                }),
         {"scissor tests",
          [](const Host& host) {
              eachIndex(host, GL_MAX_VIEWPORTS, [&](GLuint i) {
                  if (i % 2 == 0) host.gl.Enablei(GL_SCISSOR_TEST, i);
                  host.gl.ScissorIndexed(i, 0, 0, 1, 1);
              });
          },
          [](const Host& host) {
              Values values;
              eachIndex(host, GL_MAX_VIEWPORTS, [&](GLuint i) {
                  values.push_back(host.gl.IsEnabledi(GL_SCISSOR_TEST, i));
              });
              return values;
          }},
         {"scissor boxes",
          [](const Host& host) {
              eachIndex(host, GL_MAX_VIEWPORTS, [&](GLuint i) {
                  host.gl.ScissorIndexed(i, 1, 2, 3, static_cast<GLint>(4 + i));
              });
          },
          byIndex({GL_SCISSOR_BOX}, GL_MAX_VIEWPORTS, 4)},
         enabled(
             "stencil test", GL_STENCIL_TEST,
             [](const Host&) { function<PFNGLSTENCILFUNCPROC>("glStencilFunc")(GL_NEVER, 0, 1); }),
         enabled("depth test", GL_DEPTH_TEST,
                 [](const Host& host) { host.gl.DepthFunc(GL_NEVER); }),
         number("depth function", GL_DEPTH_FUNC,
                [](const Host& host) { host.gl.DepthFunc(GL_NOTEQUAL); }),
         setByPasses(number("depth mask", GL_DEPTH_WRITEMASK,
                            [](const Host& host) { host.gl.DepthMask(GL_FALSE); })),
         enabled("depth bounds test", 0x8890),
         enabled("representative fragment test", GL_REPRESENTATIVE_FRAGMENT_TEST_NV),
         {"blending",
          [](const Host& host) {
              eachIndex(host, GL_MAX_DRAW_BUFFERS, [&](GLuint i) {
                  if (i % 3 != 1) host.gl.Enablei(GL_BLEND, i);
              });
          },
          [](const Host& host) {
              Values values;
              eachIndex(host, GL_MAX_DRAW_BUFFERS,
                        [&](GLuint i) { values.push_back(host.gl.IsEnabledi(GL_BLEND, i)); });
              return values;
          }},
         {"blend equations",
          [](const Host& host) {
              eachIndex(host, GL_MAX_DRAW_BUFFERS, [&](GLuint i) {
                  host.gl.BlendEquationSeparatei(i, GL_FUNC_SUBTRACT,
                                                 i % 2 ? GL_MIN : GL_FUNC_REVERSE_SUBTRACT);
              });
          },
          byIndex({GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA}, GL_MAX_DRAW_BUFFERS, 1)},
         {"blend functions",
          [](const Host& host) {
              eachIndex(host, GL_MAX_DRAW_BUFFERS, [&](GLuint i) {
                  host.gl.BlendFuncSeparatei(i, GL_DST_COLOR, GL_SRC_ALPHA,
                                             i % 2 ? GL_ZERO : GL_DST_ALPHA,
                                             GL_ONE_MINUS_CONSTANT_COLOR);
              });
          },
          byIndex({GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB, GL_BLEND_SRC_ALPHA, GL_BLEND_DST_ALPHA},
                  GL_MAX_DRAW_BUFFERS, 1)},
         setByPasses(enabled("dither", GL_DITHER)),
         enabled("colour logic operation", GL_COLOR_LOGIC_OP,
                 [](const Host&) { function<PFNGLLOGICOPPROC>("glLogicOp")(GL_CLEAR); }),
         enabled("sRGB framebuffers", GL_FRAMEBUFFER_SRGB),
         {"colour masks",
          [](const Host& host) {
              eachIndex(host, GL_MAX_DRAW_BUFFERS,
                        [&](GLuint i) { host.gl.ColorMaski(i, 0, i % 2 != 0, 0, 1); });
          },
          byIndex({GL_COLOR_WRITEMASK}, GL_MAX_DRAW_BUFFERS, 4)},
         pixelStore("unpack alignment", GL_UNPACK_ALIGNMENT, 8),
         pixelStore("unpack row length", GL_UNPACK_ROW_LENGTH, 3),
         pixelStore("unpack image height", GL_UNPACK_IMAGE_HEIGHT, 1),
         pixelStore("unpack skipped pixels", GL_UNPACK_SKIP_PIXELS, 1),
         pixelStore("unpack skipped rows", GL_UNPACK_SKIP_ROWS, 1),
         pixelStore("unpack skipped images", GL_UNPACK_SKIP_IMAGES, 1),
         pixelStore("unpack swapped bytes", GL_UNPACK_SWAP_BYTES, 1),
         pixelStore("unpack lowest bit first", GL_UNPACK_LSB_FIRST, 1),
         pixelStore("pack alignment", GL_PACK_ALIGNMENT, 8),
         pixelStore("pack row length", GL_PACK_ROW_LENGTH, 3),
         pixelStore("pack image height", GL_PACK_IMAGE_HEIGHT, 1),
         pixelStore("pack skipped pixels", GL_PACK_SKIP_PIXELS, 1),
         pixelStore("pack skipped rows", GL_PACK_SKIP_ROWS, 1),
         pixelStore("pack skipped images", GL_PACK_SKIP_IMAGES, 1),
         pixelStore("pack swapped bytes", GL_PACK_SWAP_BYTES, 1),
         pixelStore("pack lowest bit first", GL_PACK_LSB_FIRST, 1),
         bufferTarget("pixel unpack buffer", GL_PIXEL_UNPACK_BUFFER,
                      GL_PIXEL_UNPACK_BUFFER_BINDING),
         bufferTarget("pixel pack buffer", GL_PIXEL_PACK_BUFFER, GL_PIXEL_PACK_BUFFER_BINDING),
         bufferTarget("query buffer", GL_QUERY_BUFFER, GL_QUERY_BUFFER_BINDING),
         bufferIndices("storage buffers", GL_SHADER_STORAGE_BUFFER,
                       GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS, GL_SHADER_STORAGE_BUFFER_BINDING,
                       GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE),
         bufferTarget("storage buffer target", GL_SHADER_STORAGE_BUFFER,
                      GL_SHADER_STORAGE_BUFFER_BINDING),
         bufferIndices("uniform buffers", GL_UNIFORM_BUFFER, GL_MAX_UNIFORM_BUFFER_BINDINGS,
                       GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE),
         bufferTarget("uniform buffer target", GL_UNIFORM_BUFFER, GL_UNIFORM_BUFFER_BINDING),
         {"textures",
          [](const Host& host) {
              eachIndex(host, GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, [&](GLuint unit) {
                  host.gl.BindTextureUnit(unit, host.texture(GL_TEXTURE_2D));
                  host.gl.BindTextureUnit(unit, host.texture(GL_TEXTURE_CUBE_MAP));
                  host.gl.BindTextureUnit(unit, host.texture(GL_TEXTURE_1D_ARRAY));
              });
          },
          [](const Host& host) {
              return boundToUnits(host, {GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_CUBE_MAP,
                                         GL_TEXTURE_BINDING_1D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY});
          }},
         {"samplers",
          [](const Host& host) {
              eachIndex(host, GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS,
                        [&](GLuint unit) { host.gl.BindSampler(unit, host.sampler()); });
          },
          [](const Host& host) { return boundToUnits(host, {GL_SAMPLER_BINDING}); }},
         number("active texture", GL_ACTIVE_TEXTURE,
                [](const Host& host) { host.gl.ActiveTexture(GL_TEXTURE5); }),
         setByPasses(enabled("seamless cube maps", GL_TEXTURE_CUBE_MAP_SEAMLESS)),
         number("program", GL_CURRENT_PROGRAM,
                [](const Host& host) { host.gl.UseProgram(host.program()); }),
         number("program pipeline", GL_PROGRAM_PIPELINE_BINDING,
                [](const Host& host) {
                    GLuint name = 0;
                    function<PFNGLCREATEPROGRAMPIPELINESPROC>("glCreateProgramPipelines")(1, &name);
                    host.gl.BindProgramPipeline(name);
                }),
         number("vertex array", GL_VERTEX_ARRAY_BINDING,
                [](const Host& host) { host.gl.BindVertexArray(host.vertexArray()); }),
         number("draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING,
                [](const Host& host) {
                    host.gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, host.framebuffer());
                }),
         number("read framebuffer", GL_READ_FRAMEBUFFER_BINDING, [](const Host& host) {
             host.gl.BindFramebuffer(GL_READ_FRAMEBUFFER, host.framebuffer());
         })});
    return rows;
}

const gl::StateRow& rowOf(const std::string& name) {
    const auto rows = gl::borrowedStateRows();
    const auto row = std::ranges::find_if(
        rows, [&](const gl::StateRow& candidate) { return candidate.name == name; });
    if (row == rows.end()) throw std::logic_error("the table has no row " + name);
    return *row;
}

class BorrowedStateRow : public testing::TestWithParam<std::string> {};

void expectRowIsKept(const Hostile& hostile, bool initial) {
    const Host host;
    Renderer renderer(borrowing());
    if (!initial) hostile.set(host);
    const Values before = hostile.read(host);
    const Pictures pictures = render(renderer, [&] { return hostile.read(host); });
    EXPECT_EQ(hostile.read(host), before) << "put back";
    EXPECT_TRUE(hostile.set_by_passes || pictures.state != before) << "set";
    expectExpected(pictures, hostile.name);
    // A second call must not depend on bindings from the first call.
    expectExpected(render(renderer), hostile.name + ", again");
    EXPECT_EQ(hostile.read(host), before) << "put back again";
    EXPECT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_P(BorrowedStateRow, ChangesNoPictureAndIsPutBack) {
    inOwnThread([] {
        const auto states = hostileStates();
        const auto hostile = std::ranges::find(states, GetParam(), &Hostile::name);
        ASSERT_NE(hostile, states.end()) << "no value for this row";
        if (const char* extension = rowOf(GetParam()).extension)
            if (!gl::hasExtension(Host().gl, extension))
                GTEST_SKIP() << "there is no " << extension;
        expectRowIsKept(*hostile, false);
        if (hostile->set_by_passes) expectRowIsKept(*hostile, true);
    });
}

/// Returns a sample of the rows. IsAsItWasWhateverIsRendered tests all rows at once.
std::vector<std::string> rowNames() {
    const std::size_t step = exhaustive() ? 1 : 3;
    std::vector<std::string> names;
    const auto rows = gl::borrowedStateRows();
    for (std::size_t i = 0; i < rows.size(); i += step)
        names.emplace_back(rows[i].name);
    return names;
}

INSTANTIATE_TEST_SUITE_P(Table, BorrowedStateRow, testing::ValuesIn(rowNames()),
                         [](const testing::TestParamInfo<std::string>& row) {
                             std::string name = row.param;
                             std::erase(name, ',');
                             std::ranges::replace(name, ' ', '_');
                             return name;
                         });

TEST(BorrowedState, IsAsItWasWhateverIsRendered) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        const auto states = hostileStates();
        for (const Hostile& state : states) {
            const gl::StateRow& row = rowOf(state.name);
            if (!row.extension || gl::hasExtension(host.gl, row.extension)) state.set(host);
        }
        std::vector<Values> before;
        for (const Hostile& state : states)
            before.push_back(state.read(host));
        gl::takeErrors(host.gl);  // clears errors that missing extensions caused
        expectExpected(render(renderer), "all at once");
        const Shown shown{makeScene()};
        renderer.glLayers(shown, testView(32, 24));
        renderer.nextGlLayers();
        for (const bool exact : {true, false}) {
            for (const std::string& method : methodNames(exact)) {
                CaptureSettings settings;
                settings.method = method;
                settings.tinted = true;
                settings.samples = 2;
                settings.surfaces = Surfaces::kVisible;
                renderer.composite(shown, testView(32, 24), settings);
            }
        }
        for (std::size_t i = 0; i < states.size(); ++i)
            EXPECT_EQ(states[i].read(host), before[i]) << states[i].name;
    });
}

/// Returns the error that a call throws; none if it succeeds.
template <class Call>
std::optional<Error> errorOf(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

template <class Call>
void expectUsage(Call&& call, const std::string& words) {
    const std::optional<Error> error = errorOf(call);
    ASSERT_TRUE(error) << words;
    EXPECT_EQ(error->kind(), ErrorKind::kUsage);
    EXPECT_FALSE(error->hint().empty());
    EXPECT_TRUE(contains(error->what(), words)) << error->what();
    EXPECT_EQ(error->where(), "RendererOptions::adopt");
}

TEST(BorrowedState, IsPutBackWhenACallThrows) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        const GLuint array = host.vertexArray();
        host.gl.BindVertexArray(array);
        host.gl.Enable(GL_RASTERIZER_DISCARD);
        const Shown shown{makeScene()};
        const View view = testView(16, 12);
        WatchingSink sink([] { throw std::runtime_error("enough"); });
        EXPECT_THROW(renderer.capture(shown, view, {}, sink), std::runtime_error);
        CaptureSettings unknown;
        unknown.method = "guessing";
        EXPECT_EQ(errorOf([&] { renderer.layers(shown, view, unknown); })->kind(),
                  ErrorKind::kUsage);
        EXPECT_EQ(host.count(GL_VERTEX_ARRAY_BINDING), array);
        EXPECT_TRUE(host.gl.IsEnabled(GL_RASTERIZER_DISCARD));
        expectExpected(render(renderer), "after errors");
    });
}

TEST(BorrowedState, PendingErrorsAreKeptForTheOwner) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        EXPECT_TRUE(renderer.takePendingErrors().empty());
        host.gl.Enable(GL_NONE);
        expectExpected(render(renderer), "pending errors");
        host.gl.LineWidth(-1);
        renderer.device();
        host.gl.Enable(GL_NONE);
        renderer.device();
        EXPECT_EQ(renderer.takePendingErrors(),
                  (std::vector<unsigned>{GL_INVALID_ENUM, GL_INVALID_VALUE}));
        EXPECT_TRUE(renderer.takePendingErrors().empty());
        EXPECT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
    });
}

TEST(BorrowedState, QueriesThatAreBegunAreRefused) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        const auto begin = function<PFNGLBEGINQUERYINDEXEDPROC>("glBeginQueryIndexed");
        const auto end = function<PFNGLENDQUERYINDEXEDPROC>("glEndQueryIndexed");
        struct Row {
            GLenum target;
            GLuint stream;
            const char* name;
        };
        for (const Row& row : std::initializer_list<Row>{
                 {GL_SAMPLES_PASSED, 0, "(GL_SAMPLES_PASSED)"},
                 {GL_ANY_SAMPLES_PASSED, 0, "(GL_ANY_SAMPLES_PASSED)"},
                 {GL_ANY_SAMPLES_PASSED_CONSERVATIVE, 0, "(GL_ANY_SAMPLES_PASSED_CONSERVATIVE)"},
                 {GL_PRIMITIVES_GENERATED, 0, "(GL_PRIMITIVES_GENERATED)"},
                 {GL_PRIMITIVES_GENERATED, 1, "(GL_PRIMITIVES_GENERATED)"},
                 {GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, 0,
                  "(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN)"},
                 {GL_TIME_ELAPSED, 0, "(GL_TIME_ELAPSED)"}}) {
            GLuint query = 0;
            host.gl.CreateQueries(row.target, 1, &query);
            begin(row.target, row.stream, query);
            expectUsage([&] { renderer.device(); }, row.name);
            end(row.target, row.stream);
            GLuint64 counted = 1;
            host.gl.GetQueryObjectui64v(query, GL_QUERY_RESULT, &counted);
            EXPECT_TRUE(counted == 0 || row.target == GL_TIME_ELAPSED) << row.name;
            host.gl.DeleteQueries(1, &query);
        }
        EXPECT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
        expectExpected(render(renderer), "after queries");
    });
}

TEST(BorrowedState, ConditionalRenderingIsRefused) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        GLuint query = 0;
        host.gl.CreateQueries(GL_SAMPLES_PASSED, 1, &query);
        host.gl.BeginQuery(GL_SAMPLES_PASSED, query);
        host.gl.EndQuery(GL_SAMPLES_PASSED);
        host.gl.BeginConditionalRender(query, GL_QUERY_WAIT);
        expectUsage([&] { renderer.device(); }, "conditional rendering");
        host.gl.EndConditionalRender();
        EXPECT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR)) << "it was still begun";
        expectExpected(render(renderer), "after conditional rendering");
    });
}

TEST(BorrowedState, TransformFeedbackIsRefusedUnlessItIsPaused) {
    inOwnThread([] {
        const Host host;
        Renderer renderer(borrowing());
        host.gl.BindVertexArray(host.vertexArray());
        host.gl.UseProgram(host.program());
        host.gl.BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, host.buffer());
        function<PFNGLBEGINTRANSFORMFEEDBACKPROC>("glBeginTransformFeedback")(GL_POINTS);
        ASSERT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
        expectUsage([&] { renderer.device(); }, "transform feedback");
        function<PFNGLPAUSETRANSFORMFEEDBACKPROC>("glPauseTransformFeedback")();
        expectExpected(render(renderer), "paused");
        function<PFNGLRESUMETRANSFORMFEEDBACKPROC>("glResumeTransformFeedback")();
        function<PFNGLENDTRANSFORMFEEDBACKPROC>("glEndTransformFeedback")();
        EXPECT_EQ(host.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
    });
}

TEST(BorrowedContext, HasToBeCurrent) {
    inOwnThread([] {
        expectUsage([] { Renderer{borrowing()}; }, "no OpenGL context is current");
        const Host host;
        Renderer renderer(borrowing());
        const Shown shown{makeScene()};
        const View view = testView(16, 12);
        const auto call = [&] { renderer.layers(shown, view); };
        call();
        inOwnThread([&] {
            expectUsage(call, "no OpenGL context is current");
            const Host other;
            other.vertexArray();
            expectUsage(call, "is not the borrowed one");
            EXPECT_EQ(other.gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
        });
        call();  // the host's context is still current in this thread
        {
            const Host other;
            expectUsage(call, "is not the borrowed one");
            expectUsage([&] { renderer.device(); }, "is not the borrowed one");
        }
        expectUsage(call, "no OpenGL context is current");
    });
}

TEST(BorrowedContext, LeavesItsObjectsWhereItIsNotCurrent) {
    inOwnThread([] {
        const Host host;
        auto renderer = std::make_unique<Renderer>(borrowing());
        renderer->layers({makeScene()}, testView(16, 12));
        const Host other;
        std::array<GLuint, 64> buffers{}, textures{}, arrays{};
        other.gl.CreateBuffers(64, buffers.data());
        other.gl.CreateTextures(GL_TEXTURE_2D, 64, textures.data());
        other.gl.CreateVertexArrays(64, arrays.data());
        const GLuint program = other.program();
        renderer.reset();
        const auto is_buffer = function<PFNGLISBUFFERPROC>("glIsBuffer");
        const auto is_texture = function<PFNGLISTEXTUREPROC>("glIsTexture");
        for (std::size_t i = 0; i < buffers.size(); ++i) {
            EXPECT_TRUE(is_buffer(buffers[i]));
            EXPECT_TRUE(is_texture(textures[i]));
            EXPECT_TRUE(other.gl.IsVertexArray(arrays[i]));
        }
        EXPECT_TRUE(function<PFNGLISPROGRAMPROC>("glIsProgram")(program));
    });
}

}  // namespace
}  // namespace peeler::test
