// SPDX-License-Identifier: Apache-2.0
// Colours for numbers: perceptual ramps as tables of anchors.
#pragma once

#include <array>

namespace peeler {

/// "Inferno" (N. Smith and S. van der Walt, matplotlib, CC0): black, purple, red, yellow, evenly
/// brighter to the eye. Linear Rec. 709. `share` is clipped to 0–1; NaN is 0.
std::array<float, 3> inferno(float share);

/// Dark blue to cyan: what must not be taken for a colour of the other ramp.
std::array<float, 3> blueToCyan(float share);

}  // namespace peeler
