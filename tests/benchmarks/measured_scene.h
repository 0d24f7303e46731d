// SPDX-License-Identifier: Apache-2.0
// Shared parts of the benchmark programs: a scene file with its view, and times of runs in turn.
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
    int bundles = 1;                  ///< of rays, if the program traces any
    std::vector<std::string> what{};  ///< from the program's own list; empty = its default
    std::string folder = ".";         ///< for files that are written and then removed
};

/// Parses SCENE [--size 1920x1080] [--bundles 1] [--runs 3] [--what A,B] [--folder .]. Sets the
/// threads of peeler and of Mesa. Throws Error (kUsage).
Options parse(int count, char** arguments);

/// A scene that is read and framed as in `peeler render`.
struct MeasuredScene {
    explicit MeasuredScene(const Options& options);
    Scene scene;
    PosedScene posed;
    View view;
};

/// Returns the camera in other programs' terms: eye, target, up, vertical field of view in degrees,
/// near.
nlohmann::json cameraJson(const View& view);

/// A sink that counts fragments and keeps nothing.
class CountingSink final : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { fragments += band.fragments(); }
    void finish() override {}
    std::uint64_t fragments = 0;
};

/// One competitor of a comparison.
struct Contender {
    std::string name;
    std::function<void()> work;
};

/// Returns the milliseconds of every run by name: first one untimed run of each, then `runs`
/// rounds, one after another.
nlohmann::json timesInTurn(const std::vector<Contender>& contenders, int runs);

/// Returns the milliseconds of the work.
double milliseconds(const std::function<void()>& work);

/// Returns the process's processor time so far, over all threads, with kernel time.
double processorMilliseconds();

/// Runs the program: prints the JSON that `measure` returns, or the error on stderr.
int run(int count, char** arguments, const std::function<nlohmann::json(const Options&)>& measure);

}  // namespace peeler::benchmark
