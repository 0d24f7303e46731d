// SPDX-License-Identifier: Apache-2.0
// What the programs that measure share: a scene file with its view, and times of runs in turn.
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
    int bundles = 1;                  ///< of rays, where a program traces some
    std::vector<std::string> what{};  ///< of the program's own list; empty = its default
    std::string folder = ".";         ///< for files that are written and removed again
};

/// SCENE [--size 1920x1080] [--bundles 1] [--runs 3] [--what A,B] [--folder .]. Sets the threads of
/// peeler and of Mesa. Throws Error (kUsage).
Options parse(int count, char** arguments);

/// A scene as `peeler render` reads and frames it.
struct MeasuredScene {
    explicit MeasuredScene(const Options& options);
    Scene scene;
    PosedScene posed;
    View view;
};

/// Camera as other programs take it: eye, target, up, vertical field of view in degrees, near.
nlohmann::json cameraJson(const View& view);

/// Takes bands and keeps nothing but their number of fragments.
class CountingSink final : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { fragments += band.fragments(); }
    void finish() override {}
    std::uint64_t fragments = 0;
};

/// One of the things that are compared.
struct Contender {
    std::string name;
    std::function<void()> work;
};

/// Milliseconds of every run by name: first all of them once without being timed, then one after
/// the other, `runs` times around.
nlohmann::json timesInTurn(const std::vector<Contender>& contenders, int runs);

/// Milliseconds that the work takes.
double milliseconds(const std::function<void()>& work);

/// Processor time that the process has used so far, of all threads, the kernel's work for them
/// included.
double processorMilliseconds();

/// Runs the program: prints the JSON that `measure` returns, or on stderr why there is none.
int run(int count, char** arguments, const std::function<nlohmann::json(const Options&)>& measure);

}  // namespace peeler::benchmark
