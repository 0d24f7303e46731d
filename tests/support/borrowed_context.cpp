// SPDX-License-Identifier: Apache-2.0
#include "support/borrowed_context.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "core/gl/functions.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

template <class T>
std::vector<T> contents(unsigned buffer, std::size_t count) {
    static const auto read =
        reinterpret_cast<PFNGLGETNAMEDBUFFERSUBDATAPROC>(functionOf("glGetNamedBufferSubData"));
    std::vector<T> values(count);
    read(buffer, 0, static_cast<GLsizeiptr>(count * sizeof(T)), values.data());
    return values;
}

}  // namespace

void* functionOf(const char* name) {
    using Lookup = void* (*)(const char*);
    static const Lookup lookup = [] {
        const bool egl = testBackend() == "egl";
        void* library = nullptr;
        for (const char* file : {"libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6"})
            if (!library && egl == contains(file, "EGL")) library = dlopen(file, RTLD_NOW);
        return reinterpret_cast<Lookup>(
            dlsym(library, egl ? "eglGetProcAddress" : "OSMesaGetProcAddress"));
    }();
    return lookup(name);
}

RendererOptions borrowing() {
    RendererOptions options;
    options.adopt = functionOf;
    return options;
}

LayeredImage readBack(const GlLayers& layers) {
    LayeredImage image;
    image.window = layers.window;
    image.offsets = contents<std::uint32_t>(layers.offsets, layers.window.pixels() + 1);
    const auto counts = contents<std::uint32_t>(layers.counts, layers.window.pixels());
    for (std::size_t p = 0; p < counts.size(); ++p)
        if (counts[p] != image.count(p)) ADD_FAILURE() << "count of pixel " << p;
    image.z = contents<float>(layers.depths, layers.fragments);
    image.color.channels = colorNames(layers.tinted);
    image.color.type = layers.color_type;
    const auto colors = contents<std::byte>(layers.colors, layers.fragments * layers.colorStride());
    const std::size_t stride =
        image.color.stride();  // without the unused component of colorStride()
    image.color.data.resize(layers.fragments * stride);
    for (std::size_t i = 0; i < layers.fragments; ++i)
        std::memcpy(image.color.data.data() + i * stride, colors.data() + i * layers.colorStride(),
                    stride);
    return image;
}

}  // namespace peeler::test
