// SPDX-License-Identifier: Apache-2.0
// Benchmark of capturing a scene. Contenders: peeler's A-buffer (plan and capture: count, fill,
// sort, shade, hand over), its exact composite, its other methods, and Embree (build, all hits of
// every pixel's ray, sort; no shading). Prints JSON with the milliseconds of every run.
//
//     capture SCENE [--size 1920x1080] [--runs 3] [--what a-buffer,embree]
//
// `--what`: embree, composite, or names of methods. The upload is reported separately. Embree uses
// the packet width that was fastest in untimed runs.
#include <algorithm>
#include <limits>
#include <optional>

#include "benchmarks/embree_layers.h"
#include "benchmarks/measured_scene.h"
#include "core/base/parallel.h"
#include "core/gl/context.h"
#include "support/test_support.h"

namespace peeler::benchmark {
namespace {

/// Returns the fastest packet width for this picture.
Packet fastestPacket(EmbreeLayers& embree, const View& view) {
    embree.build();
    Packet fastest = Packet::k1;
    double least = std::numeric_limits<double>::infinity();
    for (const Packet packet : {Packet::k1, Packet::k8, Packet::k16}) {
        const double taken = milliseconds([&] { embree.trace(view, packet); });
        if (taken < least) fastest = packet;
        least = std::min(least, taken);
    }
    return fastest;
}

struct Measurement {
    explicit Measurement(const Options& options) : scene(options) {}

    Contender captured(const std::string& name);
    Contender traced();

    MeasuredScene scene;
    std::unique_ptr<gl::Context> context = gl::createContext({.backend = test::testBackend()});
    std::optional<GlRenderer> renderer{};
    std::optional<EmbreeLayers> embree{};
    Packet packet = Packet::k1;
    nlohmann::json result = nlohmann::json::object();
};

Contender Measurement::captured(const std::string& name) {
    CaptureSettings settings;
    settings.composite = name == "composite";
    if (!settings.composite) settings.method = name;
    return {name, [this, name, settings] {
                const CapturePlan plan = renderer->plan(scene.view, settings);
                CountingSink sink;
                renderer->capture(plan, sink);
                result["layers"] = plan.layers.size();
                if (!settings.composite) result["fragments"] = sink.fragments;
                result["stages"][name] = renderer->takeTimes();
            }};
}

Contender Measurement::traced() {
    embree.emplace(scene.posed);
    packet = fastestPacket(*embree, scene.view);
    result["embree"] = {{"version", embree->version()},
                        {"triangles", embree->triangles()},
                        {"packet", static_cast<int>(packet)},
                        {"build", nlohmann::json::array()}};
    return {"embree", [this] {
                result["embree"]["build"].push_back(milliseconds([&] { embree->build(); }));
                result["embree"]["hits"] = embree->trace(scene.view, packet);
            }};
}

nlohmann::json measure(const Options& options) {
    Measurement m(options);
    m.result["upload"] = milliseconds([&] { m.renderer.emplace(*m.context, m.scene.posed); });
    m.result["renderer"] = m.context->device().renderer;
    m.result["threads"] = threadCount();
    m.result["camera"] = cameraJson(m.scene.view);
    std::vector<Contender> contenders;
    const std::vector<std::string> all = {"a-buffer", "embree"};
    for (const std::string& name : options.what.empty() ? all : options.what)
        contenders.push_back(name == "embree" ? m.traced() : m.captured(name));
    m.result["milliseconds"] = timesInTurn(contenders, options.runs);
    return m.result;
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    return peeler::benchmark::run(count, arguments, peeler::benchmark::measure);
}
