#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Unprojects every fragment of a peeler file to world space, with nothing but numpy.

    apt-get install python3-numpy
    peeler render scene.glb -o out.exr
    peeler extract out.exr --npz out.npz            # `peeler extract --help` lists the arrays
    python3 layers_with_numpy.py out.npz            # the numbers of `peeler info out.exr`
"""
import sys

import numpy as np


def unproject(a):
    """World-space points (n, 3) of all fragments, pixel after pixel, front to back."""
    pixel = np.repeat(np.arange(len(a["ray_splits"]) - 1), np.diff(a["ray_splits"]))
    left, top, width, _ = a["window"]
    x, y = left + pixel % width, top + pixel // width
    z = a["z"].astype(np.float64)
    scale = z if a["perspective"] else 1
    right = a["half_width"] * (2 * (x + 0.5) / a["size"][0] - 1) * scale
    up = a["half_height"] * (1 - 2 * (y + 0.5) / a["size"][1]) * scale
    return np.stack([right, up, -z, np.ones_like(z)], axis=1) @ a["camera_to_world"].T[:, :3]


def describe(points):
    """What `peeler info` prints; what rounding left of 0 is 0."""
    print(f"points: {len(points)}")
    if len(points) == 0:
        return
    low, high = points.min(axis=0), points.max(axis=0)
    smallest = 1e-9 * np.linalg.norm(high - low)
    low, high, mean = (tuple(0.0 if abs(c) <= smallest else c for c in v)
                       for v in (low, high, points.mean(axis=0)))
    print("bounds: (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)" % (low + high))
    print("mean: (%.6g, %.6g, %.6g)" % mean)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with np.load(sys.argv[1], allow_pickle=False) as arrays:
        describe(unproject(arrays))
