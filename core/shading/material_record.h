// SPDX-License-Identifier: Apache-2.0
// Materials as the shaders see them: the record of uniforms, and the features that choose a shader
// variant.
#pragma once

#include <span>

#include "core/scene/material.h"
#include "shaders/interface.glsl"

namespace peeler {

shader::MaterialRecord materialRecord(const Material& material);

/// What a material may need beyond plain metallic-roughness: a definition of the shaders', and
/// whether the material needs it.
struct MaterialFeature {
    const char* definition;
    bool (*used)(const Material&);
    bool changes_alpha = false;  ///< so that it counts where light does not, too
};
std::span<const MaterialFeature> materialFeatures();

/// Throws Error (kDevice) if the material has more textures than a shader of the device takes,
/// besides those of lights and methods.
void checkTextureUnits(Material material, int units);

}  // namespace peeler
