// SPDX-License-Identifier: Apache-2.0
// Benchmark of writing all CPU hits of several bundles as a .npz. Prints JSON with the processor
// time of every run (all threads, including kernel time) and its wall-clock time, in milliseconds.
//
//     hits SCENE [--size 1700x4] [--runs 3] [--what npz] [--folder .]
//
// `--size` is RESOLUTIONxNUMBER of the bundles. "npz" traces them and writes hits.npz, which stays
// in the folder; "capture" traces them with all channels and stores nothing; "bare" traces them
// with t and triangles only.
#include <algorithm>
#include <filesystem>
#include <numeric>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "benchmarks/measured_scene.h"
#include "core/base/parallel.h"
#include "core/raster/hit_rasterizer.h"
#include "formats/rays/ray_output.h"

namespace peeler::benchmark {
namespace {

/// A sink that forwards bands to an output, as `peeler rays` does.
class OutputSink final : public Sink {
  public:
    OutputSink(RayOutput& output, std::size_t bundle) : output_(output), bundle_(bundle) {}
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { output_.take(bundle_, band); }
    void finish() override {}

  private:
    RayOutput& output_;
    std::size_t bundle_;
};

class Hits {
  public:
    explicit Hits(const Options& options)
        : options_(options), scene_(options), source_(scene_.posed) {
        RayGrid grid;
        grid.resolution = options.width;
        const Bounds box = scene_.posed.bounds().value();
        for (const glm::dvec3& direction : sphereDirections(options.height))
            bundles_.push_back(parallelBundle("", box, box, direction, grid));
        settings_.faces = Faces::kBoth;
        settings_.hit_mode = HitMode::kRefined;
        settings_.color_type = PixelType::kFloat;
        settings_.depth_clamp = true;
        for (const Bundle& bundle : bundles_)
            hits_.push_back(source_.plan(bundle.view, settings_).fragments_counted);
    }

    void write() {
        const auto output = makeHitOutput(path(), {.posed = scene_.posed, .provenance = {}});
        settings_.channels = output->channels();
        output->begin(bundles_, hits_);
        trace([&](std::size_t bundle) { return OutputSink(*output, bundle); });
        output->finish();
    }
    void capture(bool channels) {
        settings_.channels.clear();
        if (channels)
            settings_.channels =
                makeHitOutput(path(), {.posed = scene_.posed, .provenance = {}})->channels();
        trace([](std::size_t) { return CountingSink(); });
    }

    std::string path() const {
        return (std::filesystem::path(options_.folder) / "hits.npz").string();
    }
    std::uint64_t hits() const {
        return std::accumulate(hits_.begin(), hits_.end(), std::uint64_t{0});
    }

  private:
    template <class MakeSink>
    void trace(MakeSink&& make_sink) {
        for (std::size_t i = 0; i < bundles_.size(); ++i) {
            auto sink = make_sink(i);
            source_.capture(source_.plan(bundles_[i].view, settings_), sink);
        }
    }

    const Options& options_;
    MeasuredScene scene_;
    HitRasterizer source_;
    std::vector<Bundle> bundles_;
    CaptureSettings settings_;
    std::vector<std::uint64_t> hits_;  ///< hits of each bundle
};

nlohmann::json measure(const Options& options) {
    Hits hits(options);
    std::vector<Contender> contenders = {{"npz", [&] { hits.write(); }},
                                         {"capture", [&] { hits.capture(true); }},
                                         {"bare", [&] { hits.capture(false); }}};
    if (!options.what.empty())
        std::erase_if(contenders, [&](const Contender& contender) {
            return std::ranges::count(options.what, contender.name) == 0;
        });
    nlohmann::json result = {{"threads", threadCount()}, {"hits", hits.hits()}};
    for (int i = 0; i < options.runs; ++i) {
        for (const Contender& contender : contenders) {
            // Creating the file is part of the run.
            if (contender.name == "npz") std::filesystem::remove(hits.path());
            const double before = processorMilliseconds();
            result["milliseconds"][contender.name].push_back(milliseconds(contender.work));
            result["processor"][contender.name].push_back(processorMilliseconds() - before);
        }
    }
    return result;
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    return peeler::benchmark::run(count, arguments, peeler::benchmark::measure);
}
