// SPDX-License-Identifier: Apache-2.0
// Holdouts: removal of the light that a matte in front of the fragments blocks.
#pragma once

#include <cstdint>

#include <peeler/layered_image.h>
#include "core/image/layers.h"

namespace peeler {

/// The place of a fragment of the matte that has exactly the same depth as a fragment of the image.
enum class SameDepth : std::uint8_t { kBehind, kInFront };

/// Holds `image` out by `matte`: afterwards, the composite of each list down to any depth is the
/// sum of cᵢ · Tᵢ · Mᵢ over its fragments i, where cᵢ is the fragment's premultiplied colour, Tᵢ
/// the transmittance of the image's own fragments in front of it, and Mᵢ the transmittance of the
/// matte's fragments in front of it. Hence composites of elements that hold each other out add up
/// to the composite of all elements.
///
/// Multiplying alpha by M would hide too little behind a fragment that the matte covers in part. So
/// fragment i gets the weight Mᵢ · Tᵢ / (1 − Sᵢ), where Sᵢ is the opacity shown before it: Sᵢ₊₁ =
/// Sᵢ + (1 − Sᵢ) · wᵢ · αᵢ. Fragments with weight 0 are removed. Fragments in front of the whole
/// matte stay the same, bit for bit.
///
/// The windows may differ; there is no matte outside the matte's window. A matte with the channel
/// ZBack is a volume from Z to ZBack: inside the volume, the transmittance is (1 − α)^s, where s is
/// the share of the volume in front of the depth (OpenEXR, "Interpreting OpenEXR Deep Pixels"). If
/// the matte's opacity is coloured, the image's opacity becomes coloured, too.
void holdOut(LayeredImage& image, const LayeredImage& matte, SameDepth same_depth);

/// Keeps only the selected fragments, held out by the unselected fragments as in holdOut().
/// Fragments at the same depth keep the order of their list.
void holdOutSelected(LayeredImage& image, const ObjectSelection& selection);

}  // namespace peeler
