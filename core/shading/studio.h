// SPDX-License-Identifier: Apache-2.0
// The built-in studio environment.
#pragma once

#include <peeler/scene.h>

namespace peeler {

/// Returns the built-in studio, designed for reflections in metal and glass: a large soft box and
/// several smaller ones, a floor, a horizon, and a dark side. A white surface has radiance 1.2 if
/// it faces the key light, 1.1 if it faces up, and 0.8 if it faces a viewer in front. The
/// environment has no hash. Computed at build time; the program uses embeddedStudio().
Environment studioEnvironment();
// A higher resolution would show no more detail, since every edge is several pixels wide.
inline constexpr int kStudioWidth = 256, kStudioHeight = 128;

}  // namespace peeler
