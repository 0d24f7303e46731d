// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/animation_options.h"

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/options/frames.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

namespace {

constexpr const char* kAnimationGroup = "Animation";

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
        "animation of the file to show; all plays all of them together (default: the first if a "
        "time is given, else the scene at rest)")
        .group(kAnimationGroup);
    addValue(
        verb, "--time", "SECONDS", options.time,
        [](const std::string& text) { return parseNumber(text); },
        "time in the animation, limited to the times of its first and last key")
        .group(kAnimationGroup);
}

void addFrameOptions(VerbOptions& verb, AnimationOptions& options) {
    addValue(
        verb, "--frames", "LIST", options.frames,
        [](const std::string& text) { return parseFrames(text); },
        "frames to render, e.g. 1-100, 1-100x2 (every second), 150,200-180; frame N is at N / fps "
        "seconds; put #### or %04d into the output's name for the number")
        .group(kAnimationGroup);
    addValue(verb, "--fps", "N", options.fps, parseFps, "frames per second (default: 24)")
        .group(kAnimationGroup);
}

}  // namespace peeler::cmd
