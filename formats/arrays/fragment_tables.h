// SPDX-License-Identifier: Apache-2.0
// Writes every fragment of a picture as a row of a table: a point cloud, or arrays.
#pragma once

#include <memory>
#include <string>

#include "core/image/sink.h"

namespace peeler {

struct FragmentPointOptions {
    bool double_positions = false;  ///< 64 bits, not 32
    std::string comment;            ///< one line
};

/// A Sink that writes a .ply: every fragment as a point in world space: x y z, nx ny nz from the
/// channels N, else Ng, if there are any, red green blue alpha (straight, sRGB, 8 bits), and one
/// uint for every uint channel, a '.' in its name replaced by '_'. begin() creates no file: only
/// bands know which channels there are.
std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options);

/// A Sink that writes a .npz of n fragments (formats/README.md, "Arrays and points"): `ray_splits`
/// (pixels of the crop + 1, int64: pixel p has the fragments from ray_splits[p] up to ray_splits[p
/// + 1], p row-major), `z` (n, float: camera Z, scene units), `rgba` (n, 4; half or float: linear,
/// premultiplied), `window` (x, y, width, height of the crop) and `size` (width, height of the
/// picture), int64, the camera (`perspective`, uint8; `camera_to_world`, 4 × 4 for column vectors,
/// `half_width`, `half_height`, `near`, `far`, double: NaN unless `camera_known`), and an array of
/// n for every other channel. The plan's `fragments_stored` must be the number of fragments that
/// will come.
std::unique_ptr<Sink> makeFragmentArrays(std::string path, bool camera_known);

}  // namespace peeler
