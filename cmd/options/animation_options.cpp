// SPDX-License-Identifier: Apache-2.0
// Options that say when a scene is shown, and the moments they make.
#include "cmd/options/scene_options.h"

#include <numeric>

#include "cmd/cli/arguments.h"
#include "cmd/cli/choices.h"
#include "cmd/cli/parse.h"
#include "cmd/options/frames.h"
#include "core/base/error.h"

namespace peeler::cmd {

namespace {

constexpr const char* kAnimationGroup = "Animation";
constexpr double kDefaultFps = 24;

double parseFps(const std::string& text) {
    const double fps = parseNumber(text);
    if (fps < 0.001 || fps > 1e6)
        throw Error(ErrorKind::kUsage, "expected a frame rate from 0.001 to 1000000");
    return fps;
}

}  // namespace

void addTimeOptions(VerbOptions& verb, AnimationOptions& options) {
    addValue(
        verb, "--animation", "NAME|INDEX|all", options.animation,
        [](const std::string& text) { return text; },
        "which of the file's animations (default: the first, if a time is given, else none: the "
        "scene at rest); all plays them together")
        .group(kAnimationGroup);
    addValue(
        verb, "--time", "SECONDS", options.time,
        [](const std::string& text) { return parseNumber(text); },
        "when; before its first and after its last key an animation stands still")
        .group(kAnimationGroup);
}

void addFrameOptions(VerbOptions& verb, AnimationOptions& options) {
    addValue(
        verb, "--frames", "LIST", options.frames,
        [](const std::string& text) { return parseFrames(text); },
        "pictures of a sequence, e.g. 1-100, 1-100x2 (every second), 150,200-180; frame N is at "
        "N / fps seconds. The output's name has a place for the number: #### or %04d")
        .group(kAnimationGroup);
    addValue(verb, "--fps", "N", options.fps, parseFps, "frames a second (default: 24)")
        .group(kAnimationGroup);
}

void checkAnimationOptions(const AnimationOptions& options) {
    if (options.time && options.frames) {
        throw Error(ErrorKind::kUsage, "frames have times already", "--time, --frames",
                    "leave one of them out");
    }
    if (options.fps && !options.frames && !options.time) {
        throw Error(ErrorKind::kUsage, "a frame rate is for frames", "--fps",
                    "add --frames, or --time where motion to the next frame is asked for");
    }
}

std::string animationName(const Scene& scene, std::size_t animation) {
    const std::string& name = scene.animations[animation].name;
    return name.empty() ? "animation " + std::to_string(animation) : name;
}

std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options) {
    std::vector<std::vector<std::string>> names;
    for (std::size_t i = 0; i < scene.animations.size(); ++i)
        names.push_back({animationName(scene, i)});
    if (!options.animation) {
        const bool moves = (options.time || options.frames) && !names.empty();
        return moves ? std::vector<int>{0} : std::vector<int>{};
    }
    if (*options.animation == "all" && !names.empty() && !findNameOrIndex("all", names)) {
        std::vector<int> all(names.size());
        std::iota(all.begin(), all.end(), 0);
        return all;
    }
    return {static_cast<int>(chooseFrom("animation", "--animation", *options.animation, names))};
}

std::vector<Moment> momentsOf(const AnimationOptions& options) {
    const double fps = options.fps.value_or(kDefaultFps);
    if (!options.frames) {
        const double time = options.time.value_or(0);
        return {{0, time, time + 1 / fps, 0, fps}};
    }
    std::vector<Moment> moments;
    for (const int frame : *options.frames)
        moments.push_back({frame, frame / fps, (frame + 1.0) / fps, fps, fps});
    return moments;
}

}  // namespace peeler::cmd
