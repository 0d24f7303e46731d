#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Unprojects every fragment of a picture, or every hit of rays, to world space, with nothing but numpy.

    apt-get install python3-numpy
    peeler render scene.glb -o out.exr
    peeler extract out.exr --npz out.npz            # `peeler extract --help all` lists the arrays
    python3 layers_with_numpy.py out.npz            # the numbers of `peeler info out.exr`

    peeler rays scene.glb -o hits.npz --axes        # `peeler rays --help all` lists the arrays
    python3 layers_with_numpy.py hits.npz           # the same for the hits

Also reads files with arrays_version 1.
"""
import sys

import numpy as np

NAMES = ("origin", "direction", "right", "up", "size", "resolution", "window", "perspective")


def bundles(a):
    """Returns the arrays that describe bundles of rays, each (b, ...); the pixels of a picture are one bundle."""
    if "bundle_origin" in a:
        return {name: a["bundle_" + name] for name in NAMES}
    camera = a["camera_to_world"]  # arrays_version 1 has this name
    old = (camera[:3, 3], -camera[:3, 2], camera[:3, 0], camera[:3, 1],
           2 * np.array([a["half_width"], a["half_height"]]), a["size"], a["window"], a["perspective"])
    return {name: value[np.newaxis] for name, value in zip(NAMES, old)}


def unproject(a):
    """Returns the world-space points (n, 3) of all fragments or hits, ray by ray, front to back."""
    of = bundles(a)
    rays = of["window"][:, 2:].prod(axis=1).astype(np.int64)
    ray = np.repeat(np.arange(len(a["ray_splits"]) - 1), np.diff(a["ray_splits"]))
    bundle = np.searchsorted(np.cumsum(rays), ray, side="right")
    pixel = ray - (np.cumsum(rays) - rays)[bundle]
    b = {name: values[bundle] for name, values in of.items()}
    left, top, width, _ = b["window"].T
    x, y = left + pixel % width, top + pixel // width
    across = ((x + 0.5) / b["resolution"][:, 0] - 0.5) * b["size"][:, 0]
    down = ((y + 0.5) / b["resolution"][:, 1] - 0.5) * b["size"][:, 1]
    sideways = across[:, np.newaxis] * b["right"] - down[:, np.newaxis] * b["up"]
    spread = b["perspective"].astype(bool)
    if "z" in a:
        z = a["z"].astype(np.float64)
    elif "t_hit" not in a:
        sys.exit("there is no array t_hit (nor z): peeler rays --columns has to name it")
    else:  # hits store the distance along the ray instead of the depth along the axis
        z = a["t_hit"] / np.where(spread, np.linalg.norm(b["direction"] + sideways, axis=1), 1)
    scale = np.where(spread, z, 1)
    return b["origin"] + z[:, np.newaxis] * b["direction"] + scale[:, np.newaxis] * sideways


def describe(points):
    """Prints the same numbers as `peeler info`; values that differ from 0 only by rounding become 0."""
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
