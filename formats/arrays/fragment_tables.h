// SPDX-License-Identifier: Apache-2.0
// Fragment table writers: store every fragment of a picture as a row of a point cloud or of arrays,
// in the formats of peeler and of other projects.
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
    bool double_positions = false;
    std::string comment{};  ///< a comment of one line
    /// The id.material of glTF's default material, or 0 if the file lists no materials.
    std::uint32_t default_material = 0;
};

/// Returns a Sink that writes a .ply with every fragment as a point in world space: x y z; nx ny nz
/// from the channels N, else Ng, if present (on the front if there is `facing`, else toward the
/// viewer); red green blue alpha (straight, sRGB, 8 bits); the indices primitive, node, instance
/// and material, as in points of hits; and one uint for every other uint channel, with '.' in its
/// name replaced by '_'. begin() creates no file, since the channels are known only from the first
/// band.
std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options);
/// Forecasts the exact size of the file that makeFragmentPoints() writes, assuming the plan's
/// `fragments_stored` and the channels of `band`.
SizeForecast forecastFragmentPoints(const Plan& plan, const LayeredImage& band,
                                    const FragmentPointOptions& options);

/// Returns the bytes that the Sink of makeFragmentPoints() holds per fragment of a band with these
/// channels, in addition to the band itself.
std::uint64_t fragmentPointBytes(const LayeredImage& band, const FragmentPointOptions& options);

struct FragmentArrayOptions {
    bool camera_known = true;
    std::uint32_t default_material = 0;  ///< as in FragmentPointOptions
    std::string output_hash{};           ///< stored as the text `output_hash`; "" = not stored
    bool compress = false;               ///< as in OutputOptions
    /// If set, planes are written instead of lists.
    std::optional<DenseSettings> dense{};
    bool layers_listed =
        false;  ///< planes only: whether to store `layer`, which differs from the plane's index
};

/// Returns the options for a picture's arrays, with planes if its kind is "dense".
FragmentArrayOptions arrayOptions(const OutputOptions& options);

/// Returns a Sink that writes arrays of n fragments (formats/README.md, "Arrays and points"):
/// `ray_splits` (pixels of the crop + 1, int64: pixel p, row-major, has the fragments from
/// ray_splits[p] up to ray_splits[p + 1]), `z` (n, float: camera Z, scene units), `rgba` (n, 4;
/// half or float: linear, premultiplied), `opacity` (n, 3; half or float: AR, AG, AB, if the plan
/// is tinted), the columns of fragmentColumns(), the pixels as one bundle of rays (bundleArrays();
/// NaN unless `camera_known`), and `near` and `far` (double). Exactly Plan::fragments_stored
/// fragments must be written. Bands without a channel `layer` get one.
///
/// For planes (DensePlanes), arrays of n rows become (h, w, layers, …), where (h, w) is the size of
/// the crop, and `count` (h, w; uint32: all fragments of the pixel) replaces `ray_splits`. A band's
/// values are written a few pixels at a time.
std::unique_ptr<Sink> makeFragmentArrays(std::string path, const FragmentArrayOptions& options);
/// Forecasts the exact size of the file of arrays, like forecastFragmentPoints().
SizeForecast forecastFragmentArrays(const std::string& path, const Plan& plan,
                                    const LayeredImage& band, const FragmentArrayOptions& options);
/// Returns the bytes that the Sink of makeFragmentArrays() holds per fragment, in addition to the
/// band itself. For planes, returns 0, because they are built a few pixels at a time.
std::uint64_t fragmentArrayBytes(const LayeredImage& band, const FragmentArrayOptions& options);

/// Returns a Sink that writes a sample for the loader of LaRI (Li et al., "LaRI: Layered Ray
/// Intersections for Single-view 3D Geometric Reasoning", 2025; src/datasets/objaverse.py of
/// ruili3/lari): the picture at `path`, and lariFiles() beside it. Either all files are published,
/// `path` last, or none. ImageWriter writes the picture, with PictureAlpha::kAnyFragment.
std::unique_ptr<Sink> makeLariSample(const std::string& path, const OutputOptions& options);
/// Returns the files beside the picture. For "000.png", these are 000_ldi.npz, with `ldi` (h, w,
/// 15; half: camera Z of each layer, −1 where missing), and 000.npy (3, 4; double), the matrix from
/// Blender's world (+Z up) to Blender's camera, which looks along −Z.
std::vector<std::string> lariFiles(const std::string& path);
SizeForecast forecastLariSample(const std::string& path, const Plan& plan,
                                const OutputOptions& options);

/// Returns a Sink that writes a frame of a clip for World Tracing (Zhang et al., "Generative
/// Pixel-Aligned Geometry Beyond the Visible", 2026; wt/data.py of haoz19/world-tracing): the
/// picture at `path`, as for LaRI, and worldTracingFiles() beside it. Either all files are
/// published, `path` last, or none.
std::unique_ptr<Sink> makeWorldTracingSample(const std::string& path, const OutputOptions& options);
/// Returns the file beside the picture. For "000.png", this is 000_xyz.npz, with `xyz` (6, h, w, 3;
/// float: points of each layer in camera space, in OpenCV's axes, 0 where missing), `mask` (6, h,
/// w; uint8: 1 where a layer has a point), `world_to_camera` (4, 4; double) and, in perspective,
/// `K` (3, 3; double).
std::vector<std::string> worldTracingFiles(const std::string& path);
SizeForecast forecastWorldTracingSample(const std::string& path, const Plan& plan,
                                        const OutputOptions& options);

/// Returns a Sink that writes arrays for the loader of X-Ray (Hu et al., "X-Ray: A Sequential 3D
/// Representation for Generation", 2024; src/dataset.py of tau-yihouxiang/X-Ray): a matrix in
/// scipy's CSR form, `data` (float), `indices`, `indptr` (int32, or int64 for large pictures) and
/// `shape` (2; int64). The matrix has 16 rows, one for each of the nearest layers, and 7·h·w
/// columns, so that it can be reshaped to (16, 7, h, w). The seven values are the distance from the
/// camera (0: no hit); the triangle's own normal (not interpolated), on the triangle's front
/// side, in the camera's axes (x right, y up, z backward); and the base colour, sRGB, 0–1. Every
/// hit stores all seven values, even zeros. write() throws Error (kUsage) if any of xrayChannels()
/// is missing.
std::unique_ptr<Sink> makeXray(const std::string& path, const OutputOptions& options);
std::span<const Channel> xrayChannels();
SizeForecast forecastXray(const std::string& path, const Plan& plan, const OutputOptions& options);

}  // namespace peeler
