// SPDX-License-Identifier: Apache-2.0
// Benchmark of ambient occlusion, of peeler and of Embree: bakes the vertices of models or, with
// --texels, a texture with that many texels per side. Prints time and error as a Markdown table.
//
//     bake_ao SCENE... [--directions 64,256,1024] [--resolution 512] [--reference 4096] [--runs 1]
//             [--engine cpu] [--texels 0] [--json]
//
// Both programs look along the same N directions over the sphere, with equally many threads, from
// the same points; times are processor seconds. The error is the root mean square difference from
// Embree rays along `--reference` cosine-weighted directions, different for each point; hits nearer
// than 1e-4 of the scene's diagonal do not count. A large set of points is sampled. Peeler's time
// begins with the upload or placement of the scene, Embree's with the build of its hierarchy.
// Peeler finds hits on the CPU or, with --engine gl, with the renderer of PEELER_TEST_BACKEND. With
// --json, prints an array of the rows instead, with the seconds of every run; peeler and Embree
// take turns. There, "raised" is the reference's sensitivity to the ray offset: its difference from
// a reference with rays that start that far above the surface. It comes mostly from vertices where
// parts touch.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "benchmarks/measured_scene.h"
#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"
#include "core/raster/hit_rasterizer.h"
#include "formats/gltf/gltf_reader.h"
#include "support/occlusion_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

struct Options {
    std::vector<std::string> scenes{};
    std::vector<int> directions{64, 256, 1024};
    int resolution = 512, reference = 4096, runs = 1, texels = 0;
    std::string engine = "cpu";
    bool json = false;
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
        else if (argument == "--texels")
            options.texels = value().at(0);
        else if (argument == "--engine")
            options.engine = ++i < count ? arguments[i] : "";
        else if (argument == "--json")
            options.json = true;
        else
            options.scenes.push_back(argument);
    }
    return options;
}

/// Returns the processor seconds that `work` takes over all threads.
double processorSeconds(const std::function<void()>& work) {
    const double start = benchmark::processorMilliseconds();
    work();
    return (benchmark::processorMilliseconds() - start) / 1000;
}

/// A sample of the receivers: every n-th.
class Sample {
  public:
    explicit Sample(const Receivers& all) : step_(std::max<std::size_t>(1, all.size() / kMost)) {
        for (std::size_t r = 0; r < all.size(); r += step_) {
            receivers_.positions.push_back(all.positions[r]);
            receivers_.normals.push_back(all.normals[r]);
        }
    }
    const Receivers& receivers() const { return receivers_; }
    double error(const std::vector<float>& values, const std::vector<float>& reference) const {
        std::vector<float> chosen;
        for (std::size_t r = 0; r < values.size(); r += step_)
            chosen.push_back(values[r]);
        return rootMeanSquare(receivers_, chosen, reference);
    }

  private:
    static constexpr std::size_t kMost = 100'000;
    std::size_t step_;
    Receivers receivers_;
};

/// Prints a row of the table, with the time of each program's fastest run.
void print(const nlohmann::json& row) {
    const auto fastest = [&](const char* of) {
        const auto& runs = row["seconds"][of].get_ref<const nlohmann::json::array_t&>();
        return std::ranges::min_element(runs)->get<double>();
    };
    const auto error = [&](const char* of) { return row["errors"][of].get<double>(); };
    std::printf("| %s | %zu | %d | %.2f | %.4f | %.2f | %.4f |\n",
                row["scene"].get_ref<const std::string&>().c_str(),
                row["receivers"].get<std::size_t>(), row["directions"].get<int>(),
                fastest("peeler"), error("peeler"), fastest("embree"), error("embree"));
    std::fflush(stdout);
}

/// Adds a row for each number of directions. GL finds the hits in `context`, or the CPU if
/// `context` is null.
void measure(const std::string& path, const Options& options, gl::Context* context,
             nlohmann::json& rows) {
    const Scene scene = readGltf(path);
    const PosedScene shown(scene);
    const VertexReceivers vertices(shown);
    std::optional<TexelReceivers> texels;
    if (options.texels > 0) texels.emplace(shown, vertices, TexelSettings{options.texels, 0});
    const Receivers& receivers = texels ? texels->receivers() : vertices.receivers();
    const Sample sample(receivers);
    const Bounds box = shown.bounds().value_or(Bounds{});
    const auto own_surface = static_cast<float>(1e-4 * glm::length(box.max - box.min));
    const TriangleSoup soup = soupOf(scene);
    const auto reference =
        OcclusionOracle(soup, own_surface).reference(sample.receivers(), options.reference);
    const auto raised =
        OcclusionOracle(soup, 0).reference(sample.receivers(), options.reference, own_surface);
    for (const int count : options.directions) {
        std::vector<float> ours, theirs;
        nlohmann::json row = {{"scene", std::filesystem::path(path).stem().string()},
                              {"triangles", soup.triangles.size()},
                              {"receivers", receivers.size()},
                              {"directions", count}};
        for (int i = 0; i < options.runs; ++i) {
            row["seconds"]["peeler"].push_back(processorSeconds([&] {
                std::unique_ptr<HitSource> source;
                if (context)
                    source = std::make_unique<GlRenderer>(*context, shown);
                else
                    source = std::make_unique<HitRasterizer>(shown);
                BakeSettings settings;
                settings.directions = count;
                settings.resolution = options.resolution;
                CaptureSettings capture;
                capture.faces = Faces::kBoth;
                ours = bake(*source, receivers, settings, capture, {}, {});
            }));
            row["seconds"]["embree"].push_back(processorSeconds([&] {
                theirs =
                    OcclusionOracle(soup, own_surface).along(receivers, sphereDirections(count));
            }));
        }
        row["errors"] = {{"peeler", sample.error(ours, reference)},
                         {"embree", sample.error(theirs, reference)},
                         {"raised", rootMeanSquare(sample.receivers(), raised, reference)}};
        if (!options.json) print(row);
        rows.push_back(std::move(row));
    }
}

int run(const Options& options) {
    std::unique_ptr<gl::Context> context;
    if (options.engine == "gl")
        context = gl::createContext({.backend = testBackend()});
    else if (options.engine != "cpu")
        throw Error(ErrorKind::kUsage, "--engine is cpu or gl");
    if (!options.json) {
        std::printf(
            "%s, %d threads; processor seconds; resolution %d; reference: %d directions\n\n",
            context ? context->device().renderer.c_str() : "the CPU", threadCount(),
            options.resolution, options.reference);
        std::printf(
            "| scene | receivers | directions | peeler | RMSE | Embree | RMSE |\n"
            "| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
    }
    nlohmann::json rows = nlohmann::json::array();
    for (const std::string& scene : options.scenes)
        measure(scene, options, context.get(), rows);
    if (options.json) std::printf("%s\n", rows.dump(1).c_str());
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
