// SPDX-License-Identifier: Apache-2.0
// Arrays of baked values and their locations.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/bake/receivers.h"
#include "core/scene/posed_scene.h"
#include "formats/arrays/array_writer.h"

namespace peeler::cmd {

/// Returns the arrays of writeVertexArrays(). Float: `values` (n, components), `positions` and
/// `normals` (n, 3; world space). Int64: `ranges` (r, 5) with the columns node, instance (index
/// into PosedScene::meshes()), primitive, first receiver, count.
std::vector<NamedArray> vertexArrays(const VertexReceivers& vertices, std::size_t components);
/// Writes vertexArrays() with the values. Throws Error (kOutput) if writing fails.
void writeVertexArrays(const std::string& path, const PosedScene& posed,
                       const VertexReceivers& vertices, std::span<const float> values,
                       std::size_t components);

/// Returns the arrays of writeTexelArrays(): for every atlas, `material_M` (size, size, components;
/// float; the first row has v = 0).
std::vector<NamedArray> texelArrays(const TexelReceivers& texels, std::size_t components);
/// Writes texelArrays() with the values. Throws Error (kOutput) if writing fails.
void writeTexelArrays(const std::string& path, const TexelReceivers& texels,
                      std::span<const float> values, std::size_t components, int padding);

}  // namespace peeler::cmd
