// SPDX-License-Identifier: Apache-2.0
// When a scene is shown: at rest, at a time, at the times of frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/parse.h"
#include "core/scene/scene.h"

namespace peeler::cmd {

class VerbOptions;

struct AnimationOptions {
    std::optional<std::string> animation;    ///< name, index or "all"
    std::optional<double> time;              ///< seconds
    std::optional<std::vector<int>> frames;  ///< at least one
    std::optional<Shard> chunk;              ///< of the frames
    std::optional<double> fps;
};

/// A picture of a sequence, or the only one.
struct Moment {
    int frame = 0;
    double time = 0;               ///< seconds
    double next_time = 0;          ///< of the next frame, whether it is asked for or not
    double frames_per_second = 0;  ///< 0 = it is not one of a sequence
    double motion_rate = 0;        ///< frames a second, of a sequence or not
};

/// Declares --animation and --time. `options` must outlive the parse.
void addTimeOptions(VerbOptions& verb, AnimationOptions& options);
/// Declares --frames, --chunk and --fps.
void addFrameOptions(VerbOptions& verb, AnimationOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkAnimationOptions(const AnimationOptions& options);

/// The animations to play, indices into Scene::animations: the one that is named, or all; the first
/// if a time or frames are given; else none, and the scene is at rest. Throws Error (kUsage) with
/// the list for one that is not there.
std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options);

/// The times to show, in the order asked for: frame N is at N / fps seconds. None if there are more
/// chunks than frames and this one is empty.
std::vector<Moment> momentsOf(const AnimationOptions& options);

/// What an animation is called: its own name, else "animation N".
std::string animationName(const Scene& scene, std::size_t animation);

}  // namespace peeler::cmd
