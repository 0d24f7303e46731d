// SPDX-License-Identifier: Apache-2.0
// Shared parts of the benchmark programs: a scene file with its view, and the timing of runs in
// turn.
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
    int bundles = 1;  ///< number of bundles, if the program traces any
    /// The parts to measure, from the program's own list; empty = its default.
    std::vector<std::string> what{};
    std::string folder = ".";  ///< where files are written and then removed
};

/// Parses SCENE [--size 1920x1080] [--bundles 1] [--runs 3] [--what A,B] [--folder .], and sets the
/// number of threads for peeler and for Mesa. Throws Error (kUsage).
Options parse(int count, char** arguments);

/// A scene, read and framed as by `peeler render`.
struct MeasuredScene {
    explicit MeasuredScene(const Options& options);
    Scene scene;
    PosedScene posed;
    View view;
};

/// Returns the camera in the terms of other programs: eye, target, up, vertical field of view in
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

/// One of the alternatives that a benchmark compares.
struct Contender {
    std::string name;
    std::function<void()> work;
};

/// Returns the milliseconds of every run by contender. After an untimed run of each there are
/// `runs` rounds, in which the contenders take turns.
nlohmann::json timesInTurn(const std::vector<Contender>& contenders, int runs);

/// Returns the milliseconds that `work` takes.
double milliseconds(const std::function<void()>& work);

/// Returns the processor time of this process so far, over all threads, including the kernel's.
double processorMilliseconds();

/// Runs a benchmark program: prints the JSON that `measure` returns, or an error on stderr. Returns
/// the exit code.
int run(int count, char** arguments, const std::function<nlohmann::json(const Options&)>& measure);

}  // namespace peeler::benchmark
