// SPDX-License-Identifier: Apache-2.0
// The OpenGL functions that peeler calls, loaded from the library that made the context.
#pragma once

#include <GL/glcorearb.h>

#include <functional>
#include <string>
#include <string_view>

namespace peeler::gl {

// The list of functions, used for the declarations and by the loader: X(stem of the type
// PFNGL…PROC, function name without "gl").
#define PEELER_GL_FUNCTIONS(X)                                  \
    X(ACTIVETEXTURE, ActiveTexture)                             \
    X(ATTACHSHADER, AttachShader)                               \
    X(BEGINCONDITIONALRENDER, BeginConditionalRender)           \
    X(BEGINQUERY, BeginQuery)                                   \
    X(BINDBUFFER, BindBuffer)                                   \
    X(BINDBUFFERBASE, BindBufferBase)                           \
    X(BINDBUFFERRANGE, BindBufferRange)                         \
    X(BINDFRAMEBUFFER, BindFramebuffer)                         \
    X(BINDPROGRAMPIPELINE, BindProgramPipeline)                 \
    X(BINDSAMPLER, BindSampler)                                 \
    X(BINDTEXTURE, BindTexture)                                 \
    X(BINDTEXTUREUNIT, BindTextureUnit)                         \
    X(BINDVERTEXARRAY, BindVertexArray)                         \
    X(BLENDEQUATIONI, BlendEquationi)                           \
    X(BLENDEQUATIONSEPARATEI, BlendEquationSeparatei)           \
    X(BLENDFUNCSEPARATEI, BlendFuncSeparatei)                   \
    X(CHECKNAMEDFRAMEBUFFERSTATUS, CheckNamedFramebufferStatus) \
    X(CLEARNAMEDBUFFERSUBDATA, ClearNamedBufferSubData)         \
    X(CLEARNAMEDFRAMEBUFFERFV, ClearNamedFramebufferfv)         \
    X(CLEARNAMEDFRAMEBUFFERUIV, ClearNamedFramebufferuiv)       \
    X(CLIENTWAITSYNC, ClientWaitSync)                           \
    X(CLIPCONTROL, ClipControl)                                 \
    X(COLORMASK, ColorMask)                                     \
    X(COLORMASKI, ColorMaski)                                   \
    X(COMPILESHADER, CompileShader)                             \
    X(COPYNAMEDBUFFERSUBDATA, CopyNamedBufferSubData)           \
    X(CREATEBUFFERS, CreateBuffers)                             \
    X(CREATEFRAMEBUFFERS, CreateFramebuffers)                   \
    X(CREATEPROGRAM, CreateProgram)                             \
    X(CREATEQUERIES, CreateQueries)                             \
    X(CREATESAMPLERS, CreateSamplers)                           \
    X(CREATESHADER, CreateShader)                               \
    X(CREATETEXTURES, CreateTextures)                           \
    X(CREATEVERTEXARRAYS, CreateVertexArrays)                   \
    X(CULLFACE, CullFace)                                       \
    X(DEBUGMESSAGECALLBACK, DebugMessageCallback)               \
    X(DELETEBUFFERS, DeleteBuffers)                             \
    X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                   \
    X(DELETEPROGRAM, DeleteProgram)                             \
    X(DELETEQUERIES, DeleteQueries)                             \
    X(DELETESAMPLERS, DeleteSamplers)                           \
    X(DELETESHADER, DeleteShader)                               \
    X(DELETESYNC, DeleteSync)                                   \
    X(DELETETEXTURES, DeleteTextures)                           \
    X(DELETEVERTEXARRAYS, DeleteVertexArrays)                   \
    X(DEPTHFUNC, DepthFunc)                                     \
    X(DEPTHMASK, DepthMask)                                     \
    X(DEPTHRANGEINDEXED, DepthRangeIndexed)                     \
    X(DISABLE, Disable)                                         \
    X(DISABLEI, Disablei)                                       \
    X(DISPATCHCOMPUTE, DispatchCompute)                         \
    X(DRAWARRAYS, DrawArrays)                                   \
    X(DRAWARRAYSINSTANCED, DrawArraysInstanced)                 \
    X(DRAWELEMENTSINSTANCED, DrawElementsInstanced)             \
    X(ENABLE, Enable)                                           \
    X(ENABLEI, Enablei)                                         \
    X(ENABLEVERTEXARRAYATTRIB, EnableVertexArrayAttrib)         \
    X(ENDCONDITIONALRENDER, EndConditionalRender)               \
    X(ENDQUERY, EndQuery)                                       \
    X(FENCESYNC, FenceSync)                                     \
    X(FINISH, Finish)                                           \
    X(FLUSH, Flush)                                             \
    X(FRONTFACE, FrontFace)                                     \
    X(GETBOOLEANI_V, GetBooleani_v)                             \
    X(GETDOUBLEI_V, GetDoublei_v)                               \
    X(GETDOUBLEV, GetDoublev)                                   \
    X(GETERROR, GetError)                                       \
    X(GETFLOATI_V, GetFloati_v)                                 \
    X(GETGRAPHICSRESETSTATUS, GetGraphicsResetStatus)           \
    X(GETINTEGER64I_V, GetInteger64i_v)                         \
    X(GETINTEGER64V, GetInteger64v)                             \
    X(GETINTEGERI_V, GetIntegeri_v)                             \
    X(GETINTEGERV, GetIntegerv)                                 \
    X(GETMULTISAMPLEFV, GetMultisamplefv)                       \
    X(GETOBJECTLABEL, GetObjectLabel)                           \
    X(GETPROGRAMINFOLOG, GetProgramInfoLog)                     \
    X(GETPROGRAMIV, GetProgramiv)                               \
    X(GETQUERYINDEXEDIV, GetQueryIndexediv)                     \
    X(GETQUERYOBJECTUI64V, GetQueryObjectui64v)                 \
    X(GETSHADERINFOLOG, GetShaderInfoLog)                       \
    X(GETSHADERIV, GetShaderiv)                                 \
    X(GETSTRING, GetString)                                     \
    X(GETSTRINGI, GetStringi)                                   \
    X(GETTEXTURESUBIMAGE, GetTextureSubImage)                   \
    X(HINT, Hint)                                               \
    X(ISENABLED, IsEnabled)                                     \
    X(ISENABLEDI, IsEnabledi)                                   \
    X(ISVERTEXARRAY, IsVertexArray)                             \
    X(LINEWIDTH, LineWidth)                                     \
    X(LINKPROGRAM, LinkProgram)                                 \
    X(MAPNAMEDBUFFERRANGE, MapNamedBufferRange)                 \
    X(MEMORYBARRIER, MemoryBarrier)                             \
    X(MINSAMPLESHADING, MinSampleShading)                       \
    X(NAMEDBUFFERSTORAGE, NamedBufferStorage)                   \
    X(NAMEDFRAMEBUFFERDRAWBUFFERS, NamedFramebufferDrawBuffers) \
    X(NAMEDFRAMEBUFFERPARAMETERI, NamedFramebufferParameteri)   \
    X(NAMEDFRAMEBUFFERTEXTURE, NamedFramebufferTexture)         \
    X(OBJECTLABEL, ObjectLabel)                                 \
    X(PIXELSTOREI, PixelStorei)                                 \
    X(POINTSIZE, PointSize)                                     \
    X(POLYGONMODE, PolygonMode)                                 \
    X(PROGRAMUNIFORM4I, ProgramUniform4i)                       \
    X(PROVOKINGVERTEX, ProvokingVertex)                         \
    X(SAMPLERPARAMETERI, SamplerParameteri)                     \
    X(SCISSOR, Scissor)                                         \
    X(SCISSORINDEXED, ScissorIndexed)                           \
    X(SHADERSOURCE, ShaderSource)                               \
    X(TEXTUREBARRIER, TextureBarrier)                           \
    X(TEXTURESTORAGE2D, TextureStorage2D)                       \
    X(TEXTURESTORAGE2DMULTISAMPLE, TextureStorage2DMultisample) \
    X(TEXTURESTORAGE3D, TextureStorage3D)                       \
    X(TEXTURESUBIMAGE2D, TextureSubImage2D)                     \
    X(TEXTURESUBIMAGE3D, TextureSubImage3D)                     \
    X(UNMAPNAMEDBUFFER, UnmapNamedBuffer)                       \
    X(USEPROGRAM, UseProgram)                                   \
    X(VERTEXARRAYATTRIBBINDING, VertexArrayAttribBinding)       \
    X(VERTEXARRAYATTRIBFORMAT, VertexArrayAttribFormat)         \
    X(VERTEXARRAYELEMENTBUFFER, VertexArrayElementBuffer)       \
    X(VERTEXARRAYVERTEXBUFFER, VertexArrayVertexBuffer)         \
    X(VIEWPORT, Viewport)                                       \
    X(VIEWPORTINDEXEDF, ViewportIndexedf)

/// The function pointers of one context. They are not global, because EGL and OSMesa contexts have
/// different pointers.
struct Functions {
#define X(stem, name) PFNGL##stem##PROC name = nullptr;
    PEELER_GL_FUNCTIONS(X)
#undef X
};

/// A function that returns a GL function by its full name ("glEnable"), or null if there is no such
/// function.
using ProcAddress = std::function<void*(const char* name)>;

/// Loads every function and applies checkBarriers(). Returns the name of the first missing
/// function, or "".
std::string loadFunctions(Functions& functions, const ProcAddress& lookup);

/// Whether the current context has an extension ("GL_EXT_shader_framebuffer_fetch").
bool hasExtension(const Functions& functions, std::string_view name);

}  // namespace peeler::gl
