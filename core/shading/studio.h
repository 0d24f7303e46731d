// SPDX-License-Identifier: Apache-2.0
// The built-in studio as an environment.
#pragma once

#include <peeler/scene.h>

namespace peeler {

/// The built-in studio, with what metal and glass can reflect: a large soft box and smaller ones, a
/// floor, a horizon, and a dark side. A white surface that faces the key light comes out at 1.2,
/// one that looks up at 1.1, one that faces a viewer in front at 0.7. Without a hash. Calculated
/// when peeler is built; what runs takes embeddedStudio().
Environment studioEnvironment();
// Every edge is several pixels wide, so that more of them would show no more.
inline constexpr int kStudioWidth = 256, kStudioHeight = 128;

}  // namespace peeler
