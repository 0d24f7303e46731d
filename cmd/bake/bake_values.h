// SPDX-License-Identifier: Apache-2.0
// Baked values for display and for glTF.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "core/scene/posed_scene.h"
#include "formats/gltf/baked_gltf.h"

namespace peeler::cmd {

/// The minimum, mean and maximum over all components of all values; 0 if there are no values.
struct ValueRange {
    double least = 0, mean = 0, greatest = 0;
};

ValueRange rangeOf(std::span<const float> values);

/// A mapping from values to display values, 0 to 1. Ambient occlusion and sky visibility are
/// unchanged. A bent normal n becomes (n + 1) / 2. Thickness is divided by the maximum. Irradiance
/// is divided by π; the quotient is the radiance that a white diffuse surface reflects, clipped at
/// 1 when stored.
class ShownValues {
  public:
    ShownValues(BakeQuantity quantity, const ValueRange& range);
    float operator()(float value) const { return value * scale_ + offset_; }

  private:
    float scale_ = 1, offset_ = 0;
};

/// Returns the name of the vertex attribute for the values: "_AO".
std::string attributeOf(BakeQuantity quantity);

/// Returns the values at the receivers `vertices`, grouped by node and primitive. COLOR_0 holds the
/// linear display value, multiplied with the primitive's own colour if `quantity` is an occlusion.
/// Instances of a node (EXT_mesh_gpu_instancing) get the mean of their values.
std::vector<BakedPrimitive> bakedPrimitives(const PosedScene& posed,
                                            const VertexReceivers& vertices,
                                            std::span<const float> values, BakeQuantity quantity,
                                            const ShownValues& shown);

}  // namespace peeler::cmd
