// SPDX-License-Identifier: Apache-2.0
// Renders layers with the program's own GL context: adopt SCENE
#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>

#include <cstdio>

#include "headless_context.h"

int main(int count, char** arguments) try {
    if (count < 2) return 2;
    const HeadlessContext context;
    if (!context.isCurrent()) {
        std::fprintf(stderr, "there is no OpenGL 4.5\n");
        return 5;
    }
    {
        peeler::RendererOptions options;
        options.adopt = [](const char* name) {
            return reinterpret_cast<void*>(eglGetProcAddress(name));
        };
        peeler::Renderer renderer(options);
        const peeler::Shown shown{peeler::readScene(arguments[1])};
        peeler::CameraChoice camera;
        camera.size = {320, 180};
        const auto image = renderer.layers(shown, peeler::viewOf(shown, camera));
        std::printf("%s: %zu fragments by the program's own context\n", arguments[1],
                    image.fragments());
    }
    return context.isCurrent() ? 0 : 1;
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
