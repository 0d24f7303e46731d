// SPDX-License-Identifier: Apache-2.0
// Writes every fragment of a picture as a row of a table: a point cloud, or arrays, in our dialect
// or in those of others.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
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

/// Bytes that the Sink holds of every fragment of a band like this one, besides the band.
std::uint64_t fragmentPointBytes(const LayeredImage& band, const FragmentPointOptions& options);

struct FragmentArrayOptions {
    bool camera_known = true;
    std::uint32_t default_material = 0;  ///< as in FragmentPointOptions
    std::string output_hash{};           ///< the text `output_hash`; "" = none
    /// Planes, not lists.
    std::optional<DenseSettings> dense{};
    bool layers_listed = false;  ///< of planes: they have `layer`, too, which is not their number
};

/// The options of a picture's arrays: planes if it is of the kind "dense".
FragmentArrayOptions arrayOptions(const OutputOptions& options);

/// A Sink that writes arrays of n fragments (formats/README.md, "Arrays and points"): `ray_splits`
/// (pixels of the crop + 1, int64: pixel p has the fragments from ray_splits[p] up to ray_splits[p
/// + 1], p row-major), `z` (n, float: camera Z, scene units), `rgba` (n, 4; half or float: linear,
/// premultiplied), `opacity` (n, 3; likewise: AR, AG, AB, if the plan is tinted), the columns of
/// fragmentColumns(), the pixels as one bundle of rays
/// (bundleArrays(); NaN unless `camera_known`), and `near` and `far` (double). The plan's
/// `fragments_stored` must be the number of fragments that will come. Bands without a channel
/// `layer` get it.
///
/// Of planes (DensePlanes) the arrays of n rows are (h, w, layers, …), h and w being those of the
/// crop, and `count` (h, w; uint32: all fragments of the pixel) stands in place of `ray_splits`.
/// A band's numbers go to their places some pixels at a time.
std::unique_ptr<Sink> makeFragmentArrays(std::string path, const FragmentArrayOptions& options);
/// The size of its file, to the byte, as forecastFragmentPoints() has it.
SizeForecast forecastFragmentArrays(const std::string& path, const Plan& plan,
                                    const LayeredImage& band, const FragmentArrayOptions& options);
/// Likewise as fragmentPointBytes() has it; planes are made some pixels at a time.
std::uint64_t fragmentArrayBytes(const LayeredImage& band, const FragmentArrayOptions& options);

/// A Sink of a sample as the loader of LaRI reads it (Li et al., "LaRI: Layered Ray Intersections
/// for Single-view 3D Geometric Reasoning", 2025; src/datasets/objaverse.py of ruili3/lari): the
/// picture at `path`, and lariFiles() beside it, of which all appear or none, `path` last. The
/// picture is ImageWriter's with PictureAlpha::kAnyFragment.
std::unique_ptr<Sink> makeLariSample(const std::string& path, const OutputOptions& options);
/// Of "000.png": 000_ldi.npz, with `ldi` (h, w, 15; half: camera Z of each layer, −1 where there is
/// none), and 000.npy (3, 4; double): from Blender's world, +Z up, to its camera, which looks along
/// −Z.
std::vector<std::string> lariFiles(const std::string& path);
SizeForecast forecastLariSample(const std::string& path, const Plan& plan);

/// A Sink that writes arrays as the loader of X-Ray reads it (Hu et al., "X-Ray: A Sequential 3D
/// Representation for Generation", 2024; src/dataset.py of tau-yihouxiang/X-Ray): a matrix in
/// scipy's CSR form, `data` (float), `indices`, `indptr` (int32, or int64 if there are too many
/// pixels) and `shape` (2; int64), of 16 rows, the nearest layers, and 7·h·w columns, so that
/// (16, 7, h, w) is it as an array: the distance from the camera (0: no hit), the normal on the
/// front of the flat triangle in the camera's axes (x right, y up, it looks along −z), and the base
/// colour, sRGB, 0–1. Every hit has its seven numbers, zeros among them. Needs the channels
/// xrayChannels(), else write() throws Error (kUsage).
std::unique_ptr<Sink> makeXray(const std::string& path, const std::string& output_hash);
std::span<const Channel> xrayChannels();
SizeForecast forecastXray(const std::string& path, const Plan& plan,
                          const std::string& output_hash);

}  // namespace peeler
