// SPDX-License-Identifier: Apache-2.0
// The built-in studio environment.
#pragma once

#include <peeler/scene.h>

namespace peeler {

/// Returns the built-in studio, designed for reflections in metal and glass: a large soft box and
/// smaller ones, a floor, a horizon, and a dark side. A white surface that faces the key light
/// comes out at 1.2, one that faces up at 1.1, one that faces a viewer in front at 0.7. Has no
/// hash. Computed at build time; the program uses embeddedStudio().
Environment studioEnvironment();
// Every edge is several pixels wide, so a higher resolution would show no more.
inline constexpr int kStudioWidth = 256, kStudioHeight = 128;

}  // namespace peeler
