// SPDX-License-Identifier: Apache-2.0
// Every fragment of a picture as a row of a table: a point cloud, or arrays.
#pragma once

#include <memory>
#include <string>

#include "core/image/sink.h"

namespace peeler {

struct FragmentPointOptions {
    bool double_positions = false;  ///< 64 bits, not 32
    std::string comment;            ///< one line
};

/// .ply: every fragment as a point in world space: x y z, nx ny nz from the channels N, else Ng, if
/// there are any, red green blue alpha (straight, sRGB, 8 bits), and one uint for every uint
/// channel, a '.' in its name replaced by '_'. The Sink's begin() creates nothing: only bands know
/// which channels there are.
std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options);

/// .npz: `ray_splits`, `z`, `rgba`, an array for every other channel, and the camera, NaN where it
/// is not known; formats/README.md, "Arrays and points", lists them with their types. The plan's
/// `fragments_stored` must be the number of fragments that will come.
std::unique_ptr<Sink> makeFragmentArrays(std::string path, bool camera_known);

}  // namespace peeler
