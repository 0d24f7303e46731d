// SPDX-License-Identifier: Apache-2.0
// The parts that both PLY forms of Gaussian splats share: headers.
#pragma once

#include <string_view>
#include <vector>

#include "formats/meshes/ply_elements.h"
#include "formats/splats/splat_scene.h"

namespace peeler {

/// Whether a header is a PLY's, and has all these properties.
bool hasPlyProperties(std::string_view begin, std::initializer_list<std::string_view> names);

/// Returns the properties that have these names, in order. Throws Error (kInput), which lists
/// them, if some are missing.
std::vector<const PlyField*> propertiesNamed(const MeshFile& file, const PlyElement& element,
                                             const std::vector<std::string>& names);

/// Reads all rows of an element. Calls take(values) for each row, with the values of `fields`.
void readRows(PlyElements& elements, const PlyElement& element,
              const std::vector<const PlyField*>& fields,
              const std::function<void(const std::vector<double>& values)>& take);

/// Returns "prefix0", "prefix1" … "prefix(count − 1)".
std::vector<std::string> numberedNames(const std::string& prefix, std::uint64_t count);

/// Returns the degree of the element's properties f_rest_0, f_rest_1 …. Throws Error (kInput) if
/// they make no whole degree from 0 to 3.
int degreeIn(const MeshFile& file, const PlyElement& element);

/// Whether the comments say that training reduced the opacity of dilated splats ("antialiased").
/// Warns if they say that the splats are flat (2DGS).
bool isCompensated(MeshFile& file, const PlyFile& header);

/// Assigns the values of f_rest_0, f_rest_1 …, which are first those of red, then of green, then
/// of blue, to the coefficients after the first.
template <class Values>
void setHigherHarmonics(Splat& splat, int degree, const Values& values) {
    const auto coefficients = static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < coefficients; ++i)
            splat.harmonics[i + 1][static_cast<int>(c)] = values(c * coefficients + i);
}

}  // namespace peeler
