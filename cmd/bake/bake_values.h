// SPDX-License-Identifier: Apache-2.0
// Baked values as they are shown and as a baked glTF has them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "core/scene/posed_scene.h"
#include "formats/gltf/baked_gltf.h"

namespace peeler::cmd {

/// The least, mean and greatest component of values; all 0 if there are none.
struct ValueRange {
    double least = 0, mean = 0, greatest = 0;
};

ValueRange rangeOf(std::span<const float> values);

/// Turns values of a quantity into what can be shown, 0 to 1: ao and sky visibility as they are,
/// bent normals as n / 2 + 1 / 2, thickness as a share of the greatest, irradiance as the light
/// that a white surface sends back, E / π (whoever stores it clips it at 1).
class ShownValues {
  public:
    ShownValues(BakeQuantity quantity, const ValueRange& range);
    float operator()(float value) const { return value * scale_ + offset_; }

  private:
    float scale_ = 1, offset_ = 0;
};

/// What the values are called as an attribute of vertices: "_AO".
std::string attributeOf(BakeQuantity quantity);

/// The values of the receivers `vertices`, for every primitive of every node. COLOR_0 is what can
/// be shown, linear; occlusion darkens the colour that is there. Instances that one node makes
/// (EXT_mesh_gpu_instancing) get their mean.
std::vector<BakedPrimitive> bakedPrimitives(const PosedScene& posed,
                                            const VertexReceivers& vertices,
                                            std::span<const float> values, BakeQuantity quantity,
                                            const ShownValues& shown);

}  // namespace peeler::cmd
