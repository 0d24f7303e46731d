// SPDX-License-Identifier: Apache-2.0
// Benchmark of the C++ library: library_calls SCENE SIZE CALLS prints the milliseconds per call of
// Renderer::layers() for SIZE x SIZE pixels, after a warm-up of a tenth as many calls.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>

int main(int count, char** arguments) try {
    if (count != 4) return 2;
    const peeler::Shown shown{peeler::readScene(arguments[1])};
    const int calls = std::atoi(arguments[3]);
    peeler::CameraChoice camera;
    camera.size = {std::atoi(arguments[2]), std::atoi(arguments[2])};
    peeler::Renderer renderer;
    std::size_t fragments = 0;
    const auto call = [&] {
        fragments += renderer.layers(shown, peeler::viewOf(shown, camera)).fragments();
    };
    for (int i = 0; i < calls / 10; ++i)
        call();
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i)
        call();
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start;
    std::printf("%.4f\n", passed.count() / calls);
    return fragments > 0 ? 0 : 1;
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
