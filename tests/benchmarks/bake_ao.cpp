// SPDX-License-Identifier: Apache-2.0
// Bakes the ambient occlusion of models' vertices with peeler and with Embree, side by side, and
// prints time and error as a Markdown table.
//
//     bake_ao SCENE... [--directions 64,256,1024] [--resolution 512] [--reference 4096] [--runs 1]
//             [--engine cpu]
//
// Both look along the same N directions over the sphere, with the same threads, from the same
// points; the error is the root mean square against rays of Embree along `--reference` directions
// of each point's own, cosine-weighted, where hits nearer than 1e-4 of the scene's diagonal do not
// count. Peeler's time begins with uploading the scene, Embree's with building its hierarchy.
// The last column is how much the reference itself depends on where a surface begins: its
// difference from one whose rays start that far above it, mostly at vertices where parts touch.
// Peeler's hits are found by the CPU, or with --engine gl by the renderer that PEELER_TEST_BACKEND
// chooses.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "core/base/error.h"
#include "core/capture/renderer.h"
#include "core/gl/context.h"
#include "core/raster/hit_rasterizer.h"
#include "core/rays/bundle.h"
#include "formats/gltf/gltf_reader.h"
#include "support/occlusion_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

struct Options {
    std::vector<std::string> scenes{};
    std::vector<int> directions{64, 256, 1024};
    int resolution = 512, reference = 4096, runs = 1;
    std::string engine = "cpu";
};

std::vector<int> numbers(const std::string& text) {
    std::vector<int> values;
    std::istringstream list(text);
    for (std::string item; std::getline(list, item, ',');)
        values.push_back(std::stoi(item));
    return values;
}

Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string argument = arguments[i];
        const auto value = [&] { return numbers(++i < count ? arguments[i] : ""); };
        if (argument == "--directions")
            options.directions = value();
        else if (argument == "--resolution")
            options.resolution = value().at(0);
        else if (argument == "--reference")
            options.reference = value().at(0);
        else if (argument == "--runs")
            options.runs = value().at(0);
        else if (argument == "--engine")
            options.engine = ++i < count ? arguments[i] : "";
        else
            options.scenes.push_back(argument);
    }
    return options;
}

/// Seconds of the fastest run.
double best(int runs, const std::function<void()>& work) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < runs; ++i) {
        const auto start = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        least = std::min(least, taken.count());
    }
    return least;
}

/// `context`: null = the CPU finds the hits.
void measure(const std::string& path, const Options& options, gl::Context* context) {
    const Scene scene = readGltf(path);
    const PosedScene shown(scene);
    const VertexReceivers vertices(shown);
    const Receivers& receivers = vertices.receivers();
    const Bounds box = shown.bounds().value_or(Bounds{});
    const auto own_surface = static_cast<float>(1e-4 * glm::length(box.max - box.min));
    const TriangleSoup soup = soupOf(scene);
    const auto reference =
        OcclusionOracle(soup, own_surface).reference(receivers, options.reference);
    const auto raised =
        OcclusionOracle(soup, 0).reference(receivers, options.reference, own_surface);
    for (const int count : options.directions) {
        std::vector<float> ours, theirs;
        const double our_time = best(options.runs, [&] {
            std::unique_ptr<HitSource> source;
            if (context)
                source = std::make_unique<Renderer>(*context, shown);
            else
                source = std::make_unique<HitRasterizer>(shown);
            BakeSettings settings;
            settings.directions = count;
            settings.resolution = options.resolution;
            CaptureSettings capture;
            capture.faces = Faces::kBoth;
            ours = bake(*source, receivers, settings, capture, {}, {});
        });
        const double their_time = best(options.runs, [&] {
            theirs = OcclusionOracle(soup, own_surface).along(receivers, sphereDirections(count));
        });
        std::printf("| %s | %zu | %zu | %d | %.2f s | %.4f | %.2f s | %.4f | %.4f |\n",
                    std::filesystem::path(path).stem().c_str(), soup.triangles.size(),
                    receivers.size(), count, our_time, rootMeanSquare(receivers, ours, reference),
                    their_time, rootMeanSquare(receivers, theirs, reference),
                    rootMeanSquare(receivers, raised, reference));
        std::fflush(stdout);
    }
}

int run(const Options& options) {
    std::unique_ptr<gl::Context> context;
    if (options.engine == "gl")
        context = gl::createContext({.backend = testBackend()});
    else if (options.engine != "cpu")
        throw Error(ErrorKind::kUsage, "--engine is cpu or gl");
    std::printf("%s, %d threads; resolution %d, reference of %d directions\n\n",
                context ? context->device().renderer.c_str() : "the CPU", threadCount(),
                options.resolution, options.reference);
    std::printf(
        "| scene | triangles | vertices | directions | peeler | RMSE | Embree | RMSE | raised |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
    for (const std::string& scene : options.scenes)
        measure(scene, options, context.get());
    return 0;
}

}  // namespace
}  // namespace peeler::test

int main(int count, char** arguments) {
    try {
        return peeler::test::run(peeler::test::parse(count, arguments));
    } catch (const peeler::Error& error) {
        std::fprintf(stderr, "bake_ao: %s\n", error.what());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bake_ao: %s\n", error.what());
    }
    return 2;
}
