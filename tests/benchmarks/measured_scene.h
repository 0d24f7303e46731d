// SPDX-License-Identifier: Apache-2.0
// Shared parts of the benchmark programs: a scene file with its view, and timing of alternating
// runs.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/capture/gl_renderer.h"
#include "core/scene/posed_scene.h"

namespace peeler::benchmark {

struct Options {
    std::string scene{};
    int width = 1920, height = 1080, runs = 3;
    int bundles = 1;     ///< for programs that trace bundles
    std::string lens{};  ///< for programs that trace rays: a lens model, or "lidar"
    /// The parts to measure, from the program's list; if empty, the program's default.
    std::vector<std::string> what{};
    std::string folder = ".";  ///< folder for output files
};

/// Parses SCENE [--size 1920x1080] [--bundles 1] [--lens NAME] [--runs 3] [--what A,B] [--folder
/// .]. Sets the number of threads of peeler and of Mesa. Throws Error (kUsage).
Options parse(int count, char** arguments);

/// A scene that is read and framed as by `peeler render`.
struct MeasuredScene {
    explicit MeasuredScene(const Options& options);
    Scene scene;
    PosedScene posed;
    View view;
};

/// Returns the camera as other programs describe it: eye, target, up, vertical field of view in
/// degrees, near.
nlohmann::json cameraJson(const View& view);

/// A sink that counts fragments and keeps nothing.
class CountingSink final : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { fragments += band.fragments(); }
    void finish() override {}
    std::uint64_t fragments = 0;
};

struct Contender {
    std::string name;
    std::function<void()> work;
};

/// Returns {contender: milliseconds of every run}. Each contender runs once untimed. Then the
/// contenders take turns in `runs` rounds.
nlohmann::json timesInTurn(const std::vector<Contender>& contenders, int runs);

/// Returns the milliseconds that `work` takes.
double milliseconds(const std::function<void()>& work);

/// Returns the processor time of this process over all threads, including kernel time.
double processorMilliseconds();

/// Runs a benchmark program: prints the JSON that `measure` returns, or an error on stderr. Returns
/// the exit code.
int run(int count, char** arguments, const std::function<nlohmann::json(const Options&)>& measure);

}  // namespace peeler::benchmark
