// SPDX-License-Identifier: Apache-2.0
// Lists of rays in files of NumPy.
#pragma once

#include <filesystem>
#include <vector>

#include <peeler/bundle.h>

namespace peeler {

/// Returns the rays of a .npy or .npz file (numpy.save, numpy.savez) as bundles, in the order of
/// the file. Array elements may be numbers of any type. The file has one of
///
/// - a .npy, or an array `rays`: (n, 6) or (h, w, 6), origin and direction of each ray, as in
///   Open3D's RaycastingScene
/// - arrays `origins` and `directions`: (n, 3) or (h, w, 3) each
/// - the beams of a LiDAR sensor, in degrees: `elevations` (h) and `azimuths` (w) for h × w rays,
///   or `angles` (n, 2), azimuth and elevation of each ray. `poses`: sensor to world, (4, 4), or
///   one for each azimuth (w, 4, 4) or ray (n, 4, 4), for a sensor that moves. The sensor's axes
///   are x forward, y left, z up (ROS REP 103); azimuths turn from x to y, and elevations from
///   there to z. Without poses, the sensor is at the world's origin, with z along +Y and x along
///   −Z.
///
/// Positions are in scene units and world space. Directions may have any length: Z
/// (LayeredImage::z) is the distance. Rays that are not finite, or have no direction, have no hits.
/// A list of n rays is a picture of one column; longer lists than 2^28 rays become several bundles.
///
/// The file stays mapped while the bundles exist, so it may be larger than the memory; compressed
/// arrays of a .npz are held in memory. Throws Error (kInput) if the file is damaged, or its arrays
/// have other shapes.
std::vector<Bundle> readRays(const std::filesystem::path& path);

}  // namespace peeler
