// SPDX-License-Identifier: Apache-2.0
// Writes every fragment of a picture as a row of a table: a point cloud, or arrays.
#pragma once

#include <memory>
#include <string>

#include "core/image/layered_image.h"
#include "core/image/sink.h"
#include "formats/file/size_forecast.h"

namespace peeler {

struct FragmentPointOptions {
    bool double_positions = false;       ///< 64 bits, not 32
    std::string comment{};               ///< one line
    std::uint32_t default_material = 0;  ///< the id.material of glTF's default one; 0 = none
};

/// A Sink that writes a .ply: every fragment as a point in world space: x y z, nx ny nz from the
/// channels N, else Ng, if there are any (on the front if there is `facing`, else toward the
/// viewer), red green blue alpha (straight, sRGB, 8 bits), indices as points of hits have them
/// (primitive, node, instance, material), and one uint for every other uint channel, a '.' in its
/// name replaced by '_'. begin() creates no file: only bands know which channels there are.
std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options);
/// The size of its file, to the byte, if the plan's `fragments_stored` come, with the channels of
/// `band`.
SizeForecast forecastFragmentPoints(const Plan& plan, const LayeredImage& band,
                                    const FragmentPointOptions& options);

struct FragmentArrayOptions {
    bool camera_known = true;
    std::uint32_t default_material = 0;  ///< as in FragmentPointOptions
};

/// A Sink that writes a .npz of n fragments (formats/README.md, "Arrays and points"): `ray_splits`
/// (pixels of the crop + 1, int64: pixel p has the fragments from ray_splits[p] up to ray_splits[p
/// + 1], p row-major), `z` (n, float: camera Z, scene units), `rgba` (n, 4; half or float: linear,
/// premultiplied), `opacity` (n, 3; likewise: AR, AG, AB, if the plan is tinted), the columns of
/// fragmentColumns(), the pixels as one bundle of rays
/// (bundleArrays(); NaN unless `camera_known`), and `near` and `far` (double). The plan's
/// `fragments_stored` must be the number of fragments that will come.
std::unique_ptr<Sink> makeFragmentArrays(std::string path, const FragmentArrayOptions& options);
/// The size of its file, to the byte, as forecastFragmentPoints() has it.
SizeForecast forecastFragmentArrays(const Plan& plan, const LayeredImage& band);

}  // namespace peeler
