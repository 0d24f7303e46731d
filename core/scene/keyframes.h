// SPDX-License-Identifier: Apache-2.0
// The value of keyframes at a time.
#pragma once

#include <span>

#include "core/scene/scene.h"

namespace peeler {

/// Evaluates keyframes (glTF 2.0 §3.11, appendix C) at a time that is rounded to a float, as theirs
/// are: exactly the key's value at its time, the first or the last one before and after them.
/// `value` has the width of one value. Of quaternions (x, y, z, w: `rotation`) kLinear is a
/// spherical interpolation along the shorter arc.
void sampleKeyframes(const Keyframes& keyframes, double time, bool rotation,
                     std::span<double> value);

/// When the last key of the animation is, in seconds; 0 if it has none.
double durationOf(const Animation& animation);

}  // namespace peeler
