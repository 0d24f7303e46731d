// SPDX-License-Identifier: Apache-2.0
#include "core/gl/borrowed_state.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "shaders/interface.glsl"

namespace peeler::gl {
namespace {

// The number of binding points in shaders/interface.glsl.
constexpr GLuint kTextureUnits = PEELER_LOBE_UNIT + 1;
constexpr GLuint kStorageBindings = PEELER_CHANNELS + 1;
constexpr GLuint kUniformBindings = PEELER_MATERIAL_BLOCK + 1;
constexpr GLuint kClipDistances = 8;  // the number that GL guarantees (GL_MAX_CLIP_DISTANCES)

constexpr std::array<std::pair<GLenum, GLenum>, 11> kTextures = {{
    {GL_TEXTURE_1D, GL_TEXTURE_BINDING_1D},
    {GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D},
    {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D},
    {GL_TEXTURE_1D_ARRAY, GL_TEXTURE_BINDING_1D_ARRAY},
    {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY},
    {GL_TEXTURE_RECTANGLE, GL_TEXTURE_BINDING_RECTANGLE},
    {GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BINDING_CUBE_MAP},
    {GL_TEXTURE_CUBE_MAP_ARRAY, GL_TEXTURE_BINDING_CUBE_MAP_ARRAY},
    {GL_TEXTURE_BUFFER, GL_TEXTURE_BINDING_BUFFER},
    {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE},
    {GL_TEXTURE_2D_MULTISAMPLE_ARRAY, GL_TEXTURE_BINDING_2D_MULTISAMPLE_ARRAY},
}};

GLint integer(const Functions& gl, GLenum parameter) {
    std::array<GLint, 2> value{};  // GL_POLYGON_MODE has two values in older drivers
    gl.GetIntegerv(parameter, value.data());
    return value[0];
}

GLuint count(const Functions& gl, GLenum parameter) {
    return static_cast<GLuint>(integer(gl, parameter));
}

GLenum asEnum(double value) {
    return static_cast<GLenum>(value);
}

GLint asInt(double value) {
    return static_cast<GLint>(value);
}

GLboolean asBoolean(double value) {
    return value != 0 ? GL_TRUE : GL_FALSE;
}

void set(const Functions& gl, GLenum capability, double on) {
    if (on != 0)
        gl.Enable(capability);
    else
        gl.Disable(capability);
}

void set(const Functions& gl, GLenum capability, GLuint index, double on) {
    if (on != 0)
        gl.Enablei(capability, index);
    else
        gl.Disablei(capability, index);
}

StateValues readEnabled(const Functions& gl, GLenum capability) {
    return {static_cast<double>(gl.IsEnabled(capability))};
}

void writeEnabled(const Functions& gl, GLenum capability, const StateValues& values) {
    set(gl, capability, values[0]);
}

StateValues readClipDistances(const Functions& gl, GLenum first) {
    StateValues values;
    for (GLuint i = 0; i < kClipDistances; ++i)
        values.push_back(gl.IsEnabled(first + i));
    return values;
}

void writeClipDistances(const Functions& gl, GLenum first, const StateValues& values) {
    for (GLuint i = 0; i < kClipDistances; ++i)
        set(gl, first + i, values[i]);
}

StateValues readEnabledByIndex(const Functions& gl, GLenum capability, GLenum how_many) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, how_many); ++i)
        values.push_back(gl.IsEnabledi(capability, i));
    return values;
}

/// Read a capability of each draw buffer, and of each viewport.
StateValues readBlending(const Functions& gl, GLenum capability) {
    return readEnabledByIndex(gl, capability, GL_MAX_DRAW_BUFFERS);
}

StateValues readScissorTests(const Functions& gl, GLenum capability) {
    return readEnabledByIndex(gl, capability, GL_MAX_VIEWPORTS);
}

void writeEnabledByIndex(const Functions& gl, GLenum capability, const StateValues& values) {
    for (GLuint i = 0; i < values.size(); ++i)
        set(gl, capability, i, values[i]);
}

StateValues readInteger(const Functions& gl, GLenum parameter) {
    return {static_cast<double>(integer(gl, parameter))};
}

StateValues readDouble(const Functions& gl, GLenum parameter) {
    GLdouble value = 0;
    gl.GetDoublev(parameter, &value);
    return {value};
}

void writePixelStore(const Functions& gl, GLenum parameter, const StateValues& values) {
    gl.PixelStorei(parameter, asInt(values[0]));
}

/// Writes the non-indexed binding of a buffer target. If the buffer no longer exists (GlLayers),
/// binds no buffer, as GL does when it deletes a bound buffer.
template <GLenum Target>
void writeBuffer(const Functions& gl, GLenum, const StateValues& values) {
    gl.BindBuffer(Target, 0);
    gl.BindBuffer(Target, asEnum(values[0]));
}

/// Returns the name, start and size of every binding. Size 0: the whole buffer is bound.
StateValues readBindings(const Functions& gl, GLenum binding, GLenum start, GLenum size,
                         GLuint bindings) {
    StateValues values;
    for (GLuint i = 0; i < bindings; ++i) {
        GLint name = 0;
        std::array<GLint64, 2> range{};
        gl.GetIntegeri_v(binding, i, &name);
        gl.GetInteger64i_v(start, i, &range[0]);
        gl.GetInteger64i_v(size, i, &range[1]);
        values.push_back(name);
        values.push_back(static_cast<double>(range[0]));
        values.push_back(static_cast<double>(range[1]));
    }
    return values;
}

/// Writes every binding. If a buffer no longer exists, binds no buffer in its place.
template <GLenum Target>
void writeBindings(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 2 < values.size(); i += 3) {
        const auto index = static_cast<GLuint>(i / 3), name = static_cast<GLuint>(values[i]);
        gl.BindBufferBase(Target, index, 0);
        if (name == 0 || values[i + 2] == 0)
            gl.BindBufferBase(Target, index, name);
        else
            gl.BindBufferRange(Target, index, name, static_cast<GLintptr>(values[i + 1]),
                               static_cast<GLsizeiptr>(values[i + 2]));
    }
}

StateValues readStorage(const Functions& gl, GLenum binding) {
    return readBindings(gl, binding, GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE,
                        kStorageBindings);
}

StateValues readUniforms(const Functions& gl, GLenum binding) {
    return readBindings(gl, binding, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE,
                        kUniformBindings);
}

/// Calls each(unit) for every texture unit while that unit is active.
template <class Each>
void forEachUnit(const Functions& gl, Each each) {
    const auto active = static_cast<GLenum>(integer(gl, GL_ACTIVE_TEXTURE));
    for (GLuint unit = 0; unit < kTextureUnits; ++unit) {
        gl.ActiveTexture(GL_TEXTURE0 + unit);
        each(unit);
    }
    gl.ActiveTexture(active);
}

StateValues readTextures(const Functions& gl, GLenum) {
    StateValues values;
    forEachUnit(gl, [&](GLuint) {
        for (const auto& [target, binding] : kTextures)
            values.push_back(integer(gl, binding));
    });
    return values;
}

void writeTextures(const Functions& gl, GLenum, const StateValues& values) {
    auto value = values.begin();
    forEachUnit(gl, [&](GLuint) {
        for (const auto& [target, binding] : kTextures)
            gl.BindTexture(target, asEnum(*value++));
    });
}

StateValues readSamplers(const Functions& gl, GLenum binding) {
    StateValues values;
    forEachUnit(gl, [&](GLuint) { values.push_back(integer(gl, binding)); });
    return values;
}

void writeSamplers(const Functions& gl, GLenum, const StateValues& values) {
    for (GLuint unit = 0; unit < kTextureUnits; ++unit)
        gl.BindSampler(unit, asEnum(values[unit]));
}

StateValues readColorMask(const Functions& gl, GLenum parameter) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, GL_MAX_DRAW_BUFFERS); ++i) {
        std::array<GLboolean, 4> mask{};
        gl.GetBooleani_v(parameter, i, mask.data());
        values.insert(values.end(), mask.begin(), mask.end());
    }
    return values;
}

void writeColorMask(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 3 < values.size(); i += 4)
        gl.ColorMaski(static_cast<GLuint>(i / 4), asBoolean(values[i]), asBoolean(values[i + 1]),
                      asBoolean(values[i + 2]), asBoolean(values[i + 3]));
}

/// Returns these parameters of every draw buffer.
StateValues readOfDrawBuffers(const Functions& gl, std::span<const GLenum> parameters) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, GL_MAX_DRAW_BUFFERS); ++i) {
        for (const GLenum parameter : parameters) {
            GLint value = 0;
            gl.GetIntegeri_v(parameter, i, &value);
            values.push_back(value);
        }
    }
    return values;
}

StateValues readBlendEquations(const Functions& gl, GLenum) {
    return readOfDrawBuffers(gl,
                             std::array<GLenum, 2>{GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA});
}

void writeBlendEquations(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 1 < values.size(); i += 2)
        gl.BlendEquationSeparatei(static_cast<GLuint>(i / 2), asEnum(values[i]),
                                  asEnum(values[i + 1]));
}

StateValues readBlendFunctions(const Functions& gl, GLenum) {
    return readOfDrawBuffers(gl, std::array<GLenum, 4>{GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB,
                                                       GL_BLEND_SRC_ALPHA, GL_BLEND_DST_ALPHA});
}

void writeBlendFunctions(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 3 < values.size(); i += 4)
        gl.BlendFuncSeparatei(static_cast<GLuint>(i / 4), asEnum(values[i]), asEnum(values[i + 1]),
                              asEnum(values[i + 2]), asEnum(values[i + 3]));
}

StateValues readViewports(const Functions& gl, GLenum parameter) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, GL_MAX_VIEWPORTS); ++i) {
        std::array<GLfloat, 4> box{};
        gl.GetFloati_v(parameter, i, box.data());
        values.insert(values.end(), box.begin(), box.end());
    }
    return values;
}

void writeViewports(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 3 < values.size(); i += 4)
        gl.ViewportIndexedf(static_cast<GLuint>(i / 4), static_cast<GLfloat>(values[i]),
                            static_cast<GLfloat>(values[i + 1]),
                            static_cast<GLfloat>(values[i + 2]),
                            static_cast<GLfloat>(values[i + 3]));
}

StateValues readScissorBoxes(const Functions& gl, GLenum parameter) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, GL_MAX_VIEWPORTS); ++i) {
        std::array<GLint, 4> box{};
        gl.GetIntegeri_v(parameter, i, box.data());
        values.insert(values.end(), box.begin(), box.end());
    }
    return values;
}

void writeScissorBoxes(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 3 < values.size(); i += 4)
        gl.ScissorIndexed(static_cast<GLuint>(i / 4), asInt(values[i]), asInt(values[i + 1]),
                          asInt(values[i + 2]), asInt(values[i + 3]));
}

StateValues readDepthRanges(const Functions& gl, GLenum parameter) {
    StateValues values;
    for (GLuint i = 0; i < count(gl, GL_MAX_VIEWPORTS); ++i) {
        std::array<GLdouble, 2> range{};
        gl.GetDoublei_v(parameter, i, range.data());
        values.insert(values.end(), range.begin(), range.end());
    }
    return values;
}

void writeDepthRanges(const Functions& gl, GLenum, const StateValues& values) {
    for (std::size_t i = 0; i + 1 < values.size(); i += 2)
        gl.DepthRangeIndexed(static_cast<GLuint>(i / 2), values[i], values[i + 1]);
}

StateValues readClipControl(const Functions& gl, GLenum) {
    return {static_cast<double>(integer(gl, GL_CLIP_ORIGIN)),
            static_cast<double>(integer(gl, GL_CLIP_DEPTH_MODE))};
}

void writeClipControl(const Functions& gl, GLenum, const StateValues& values) {
    gl.ClipControl(asEnum(values[0]), asEnum(values[1]));
}

void writeDepthFunction(const Functions& gl, GLenum, const StateValues& values) {
    gl.DepthFunc(asEnum(values[0]));
}

void writeDepthMask(const Functions& gl, GLenum, const StateValues& values) {
    gl.DepthMask(asBoolean(values[0]));
}

void writeCullFace(const Functions& gl, GLenum, const StateValues& values) {
    gl.CullFace(asEnum(values[0]));
}

void writeFrontFace(const Functions& gl, GLenum, const StateValues& values) {
    gl.FrontFace(asEnum(values[0]));
}

void writePolygonMode(const Functions& gl, GLenum, const StateValues& values) {
    gl.PolygonMode(GL_FRONT_AND_BACK, asEnum(values[0]));
}

void writeProvokingVertex(const Functions& gl, GLenum, const StateValues& values) {
    gl.ProvokingVertex(asEnum(values[0]));
}

void writeMinSampleShading(const Functions& gl, GLenum, const StateValues& values) {
    gl.MinSampleShading(static_cast<GLfloat>(values[0]));
}

void writeLineWidth(const Functions& gl, GLenum, const StateValues& values) {
    gl.LineWidth(static_cast<GLfloat>(values[0]));
}

void writePointSize(const Functions& gl, GLenum, const StateValues& values) {
    gl.PointSize(static_cast<GLfloat>(values[0]));
}

void writeHint(const Functions& gl, GLenum target, const StateValues& values) {
    gl.Hint(target, asEnum(values[0]));
}

void writeProgram(const Functions& gl, GLenum, const StateValues& values) {
    gl.UseProgram(asEnum(values[0]));
}

void writePipeline(const Functions& gl, GLenum, const StateValues& values) {
    gl.BindProgramPipeline(asEnum(values[0]));
}

void writeVertexArray(const Functions& gl, GLenum, const StateValues& values) {
    gl.BindVertexArray(asEnum(values[0]));
}

template <GLenum Target>
void writeFramebuffer(const Functions& gl, GLenum, const StateValues& values) {
    gl.BindFramebuffer(Target, asEnum(values[0]));
}

void writeActiveTexture(const Functions& gl, GLenum, const StateValues& values) {
    gl.ActiveTexture(asEnum(values[0]));
}

StateRow capability(const char* name, GLenum parameter, double needed = 0,
                    const char* extension = nullptr) {
    return {name, parameter, readEnabled, writeEnabled, {needed}, extension};
}

StateRow pixelStore(const char* name, GLenum parameter, double needed = 0) {
    return {name, parameter, readInteger, writePixelStore, {needed}};
}

constexpr GLenum kDepthBoundsTest = 0x8890;  // EXT_depth_bounds_test; not in glcorearb.h

const std::vector<StateRow>& rows() {
    static const std::vector<StateRow> table = {
        // Vertices and primitives.
        capability("rasterizer discard", GL_RASTERIZER_DISCARD),
        capability("primitive restart", GL_PRIMITIVE_RESTART),
        capability("primitive restart, fixed index", GL_PRIMITIVE_RESTART_FIXED_INDEX),
        {"clip distances", GL_CLIP_DISTANCE0, readClipDistances, writeClipDistances, {0}},
        {"provoking vertex",
         GL_PROVOKING_VERTEX,
         readInteger,
         writeProvokingVertex,
         {GL_LAST_VERTEX_CONVENTION}},
        // Clip space and the window.
        {"clip control",
         GL_CLIP_ORIGIN,
         readClipControl,
         writeClipControl,
         {GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE}},
        capability("depth clamp", GL_DEPTH_CLAMP),
        {"viewports", GL_VIEWPORT, readViewports, writeViewports, {}},
        {"depth ranges", GL_DEPTH_RANGE, readDepthRanges, writeDepthRanges, {0, 1}},
        // Rasterisation.
        capability("program point size", GL_PROGRAM_POINT_SIZE),
        {"point size", GL_POINT_SIZE, readDouble, writePointSize, {1}},
        {"line width", GL_LINE_WIDTH, readDouble, writeLineWidth, {1}},
        capability("line smooth", GL_LINE_SMOOTH),
        capability("polygon smooth", GL_POLYGON_SMOOTH),
        {"polygon mode", GL_POLYGON_MODE, readInteger, writePolygonMode, {GL_FILL}},
        capability("polygon offset, fill", GL_POLYGON_OFFSET_FILL),
        capability("polygon offset, line", GL_POLYGON_OFFSET_LINE),
        capability("polygon offset, point", GL_POLYGON_OFFSET_POINT),
        capability("cull face", GL_CULL_FACE),
        {"cull face mode", GL_CULL_FACE_MODE, readInteger, writeCullFace, {GL_BACK}},
        {"front face", GL_FRONT_FACE, readInteger, writeFrontFace, {GL_CCW}},
        capability("conservative rasterization, NVIDIA", GL_CONSERVATIVE_RASTERIZATION_NV, 0,
                   "GL_NV_conservative_raster"),
        capability("conservative rasterization, Intel", GL_CONSERVATIVE_RASTERIZATION_INTEL, 0,
                   "GL_INTEL_conservative_rasterization"),
        capability("shading rate image", GL_SHADING_RATE_IMAGE_NV, 0, "GL_NV_shading_rate_image"),
        // Samples.
        capability("multisample", GL_MULTISAMPLE, 1),
        capability("sample alpha to coverage", GL_SAMPLE_ALPHA_TO_COVERAGE),
        capability("sample alpha to one", GL_SAMPLE_ALPHA_TO_ONE),
        capability("sample coverage", GL_SAMPLE_COVERAGE),
        capability("sample mask", GL_SAMPLE_MASK),
        capability("sample shading", GL_SAMPLE_SHADING),
        {"minimum sample shading",
         GL_MIN_SAMPLE_SHADING_VALUE,
         readDouble,
         writeMinSampleShading,
         {}},
        // Fragments.
        {"derivative hint",
         GL_FRAGMENT_SHADER_DERIVATIVE_HINT,
         readInteger,
         writeHint,
         {GL_DONT_CARE}},
        {"scissor tests", GL_SCISSOR_TEST, readScissorTests, writeEnabledByIndex, {0}},
        {"scissor boxes", GL_SCISSOR_BOX, readScissorBoxes, writeScissorBoxes, {}},
        capability("stencil test", GL_STENCIL_TEST),
        capability("depth test", GL_DEPTH_TEST),
        {"depth function", GL_DEPTH_FUNC, readInteger, writeDepthFunction, {GL_LESS}},
        {"depth mask", GL_DEPTH_WRITEMASK, readInteger, writeDepthMask, {GL_TRUE}},
        capability("depth bounds test", kDepthBoundsTest, 0, "GL_EXT_depth_bounds_test"),
        capability("representative fragment test", GL_REPRESENTATIVE_FRAGMENT_TEST_NV, 0,
                   "GL_NV_representative_fragment_test"),
        {"blending", GL_BLEND, readBlending, writeEnabledByIndex, {0}},
        {"blend equations",
         GL_BLEND_EQUATION_RGB,
         readBlendEquations,
         writeBlendEquations,
         {GL_FUNC_ADD}},
        {"blend functions",
         GL_BLEND_SRC_RGB,
         readBlendFunctions,
         writeBlendFunctions,
         {GL_ONE, GL_ZERO}},
        capability("dither", GL_DITHER, 1),
        capability("colour logic operation", GL_COLOR_LOGIC_OP),
        capability("sRGB framebuffers", GL_FRAMEBUFFER_SRGB),
        {"colour masks", GL_COLOR_WRITEMASK, readColorMask, writeColorMask, {GL_TRUE}},
        // Pixel transfer.
        pixelStore("unpack alignment", GL_UNPACK_ALIGNMENT, 4),
        pixelStore("unpack row length", GL_UNPACK_ROW_LENGTH),
        pixelStore("unpack image height", GL_UNPACK_IMAGE_HEIGHT),
        pixelStore("unpack skipped pixels", GL_UNPACK_SKIP_PIXELS),
        pixelStore("unpack skipped rows", GL_UNPACK_SKIP_ROWS),
        pixelStore("unpack skipped images", GL_UNPACK_SKIP_IMAGES),
        pixelStore("unpack swapped bytes", GL_UNPACK_SWAP_BYTES),
        pixelStore("unpack lowest bit first", GL_UNPACK_LSB_FIRST),
        pixelStore("pack alignment", GL_PACK_ALIGNMENT, 4),
        pixelStore("pack row length", GL_PACK_ROW_LENGTH),
        pixelStore("pack image height", GL_PACK_IMAGE_HEIGHT),
        pixelStore("pack skipped pixels", GL_PACK_SKIP_PIXELS),
        pixelStore("pack skipped rows", GL_PACK_SKIP_ROWS),
        pixelStore("pack skipped images", GL_PACK_SKIP_IMAGES),
        pixelStore("pack swapped bytes", GL_PACK_SWAP_BYTES),
        pixelStore("pack lowest bit first", GL_PACK_LSB_FIRST),
        {"pixel unpack buffer",
         GL_PIXEL_UNPACK_BUFFER_BINDING,
         readInteger,
         writeBuffer<GL_PIXEL_UNPACK_BUFFER>,
         {0}},
        {"pixel pack buffer",
         GL_PIXEL_PACK_BUFFER_BINDING,
         readInteger,
         writeBuffer<GL_PIXEL_PACK_BUFFER>,
         {0}},
        {"query buffer", GL_QUERY_BUFFER_BINDING, readInteger, writeBuffer<GL_QUERY_BUFFER>, {0}},
        // Rows of objects. Index bindings come before the binding of their target, because binding
        // a buffer to an index also binds it to the target.
        {"storage buffers",
         GL_SHADER_STORAGE_BUFFER_BINDING,
         readStorage,
         writeBindings<GL_SHADER_STORAGE_BUFFER>,
         {0}},
        {"storage buffer target",
         GL_SHADER_STORAGE_BUFFER_BINDING,
         readInteger,
         writeBuffer<GL_SHADER_STORAGE_BUFFER>,
         {0}},
        {"uniform buffers",
         GL_UNIFORM_BUFFER_BINDING,
         readUniforms,
         writeBindings<GL_UNIFORM_BUFFER>,
         {0}},
        {"uniform buffer target",
         GL_UNIFORM_BUFFER_BINDING,
         readInteger,
         writeBuffer<GL_UNIFORM_BUFFER>,
         {0}},
        {"textures", GL_TEXTURE_BINDING_2D, readTextures, writeTextures, {0}},
        {"samplers", GL_SAMPLER_BINDING, readSamplers, writeSamplers, {0}},
        {"active texture", GL_ACTIVE_TEXTURE, readInteger, writeActiveTexture, {GL_TEXTURE0}},
        capability("seamless cube maps", GL_TEXTURE_CUBE_MAP_SEAMLESS),
        {"program", GL_CURRENT_PROGRAM, readInteger, writeProgram, {0}},
        {"program pipeline", GL_PROGRAM_PIPELINE_BINDING, readInteger, writePipeline, {0}},
        {"vertex array", GL_VERTEX_ARRAY_BINDING, readInteger, writeVertexArray, {0}},
        {"draw framebuffer",
         GL_DRAW_FRAMEBUFFER_BINDING,
         readInteger,
         writeFramebuffer<GL_DRAW_FRAMEBUFFER>,
         {}},
        {"read framebuffer",
         GL_READ_FRAMEBUFFER_BINDING,
         readInteger,
         writeFramebuffer<GL_READ_FRAMEBUFFER>,
         {}},
    };
    return table;
}

/// Returns `needed`, repeated to a length of `values`.
StateValues repeated(const StateValues& needed, std::size_t values) {
    StateValues all(values);
    for (std::size_t i = 0; i < values; ++i)
        all[i] = needed[i % needed.size()];
    return all;
}

[[noreturn]] void refuse(const std::string& what, const std::string& hint) {
    throw Error(ErrorKind::kUsage, what + " is active in the borrowed context",
                "RendererOptions::adopt", hint);
}

struct QueryRow {
    GLenum target;
    const char* name;
    bool streams;  ///< whether each vertex stream has its own query
};
constexpr std::array<QueryRow, 6> kQueries = {{
    {GL_SAMPLES_PASSED, "GL_SAMPLES_PASSED", false},
    {GL_ANY_SAMPLES_PASSED, "GL_ANY_SAMPLES_PASSED", false},
    {GL_ANY_SAMPLES_PASSED_CONSERVATIVE, "GL_ANY_SAMPLES_PASSED_CONSERVATIVE", false},
    {GL_PRIMITIVES_GENERATED, "GL_PRIMITIVES_GENERATED", true},
    {GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, "GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN", true},
    {GL_TIME_ELAPSED, "GL_TIME_ELAPSED", false},
}};

/// Whether conditional rendering is active. GL has no query for this, so this function tries to
/// begin conditional rendering: GL raises an error if conditional rendering is already active.
bool rendersConditionally(const Functions& gl) {
    GLuint query = 0;
    gl.CreateQueries(GL_SAMPLES_PASSED, 1, &query);
    gl.BeginConditionalRender(query, GL_QUERY_NO_WAIT);
    const bool begun = gl.GetError() == GL_NO_ERROR;
    if (begun) gl.EndConditionalRender();
    gl.DeleteQueries(1, &query);
    return !begun;
}

}  // namespace

std::span<const StateRow> borrowedStateRows() {
    return rows();
}

std::vector<GLenum> takeErrors(const Functions& gl) {
    // Limits the number of iterations. GL keeps at most one error of each kind, but a lost context
    // returns the same error forever.
    constexpr std::size_t kMost = 16;
    std::vector<GLenum> errors;
    while (errors.size() < kMost) {
        const GLenum code = gl.GetError();
        if (code == GL_NO_ERROR) break;
        errors.push_back(code);
        if (code == GL_CONTEXT_LOST) break;
    }
    return errors;
}

void requireNothingBegun(const Functions& gl) {
    for (const QueryRow& query : kQueries) {
        const GLuint streams = query.streams ? count(gl, GL_MAX_VERTEX_STREAMS) : 1;
        for (GLuint stream = 0; stream < streams; ++stream) {
            GLint active = 0;
            gl.GetQueryIndexediv(query.target, stream, GL_CURRENT_QUERY, &active);
            if (active != 0)
                refuse(std::string("a query (") + query.name + ")",
                       "end it before the call (glEndQuery) and begin it again afterwards");
        }
    }
    if (integer(gl, GL_TRANSFORM_FEEDBACK_ACTIVE) != 0 &&
        integer(gl, GL_TRANSFORM_FEEDBACK_PAUSED) == 0)
        refuse("transform feedback",
               "pause it before the call (glPauseTransformFeedback) and resume it afterwards");
    if (rendersConditionally(gl))
        refuse("conditional rendering",
               "end it before the call (glEndConditionalRender) and begin it again afterwards");
}

BorrowedState::BorrowedState(const Functions& gl) : gl_(gl) {
    for (const StateRow& row : rows()) {
        if (row.extension && !hasExtension(gl, row.extension)) continue;
        kept_.push_back({&row, row.read(gl, row.parameter)});
    }
    for (const Kept& kept : kept_) {
        const StateRow& row = *kept.row;
        if (!row.needed.empty())
            row.write(gl, row.parameter, repeated(row.needed, kept.values.size()));
    }
}

BorrowedState::~BorrowedState() {
    for (const Kept& kept : kept_)
        kept.row->write(gl_, kept.row->parameter, kept.values);
    takeErrors(gl_);
}

}  // namespace peeler::gl
