#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Unprojects every layer of a peeler file to world space, with OpenImageIO and numpy.

    apt-get install python3-openimageio python3-numpy
    peeler render scene.glb -o out.exr
    python3 layers_with_openimageio.py out.exr      # the numbers of `peeler info out.exr`
"""
import json
import sys

import numpy as np
import OpenImageIO as oiio


def layers(path):
    """Yields (camera, x, y, z, rgba) for the fragments of each layer, from front to back."""
    image = oiio.ImageInput.open(path)
    if image is None:
        sys.exit(oiio.geterror())
    spec = image.spec()
    if spec.deep or spec.getattribute("peeler:layout") not in (None, "plain"):
        sys.exit("only layered files with a part a layer are read here: "
                 "peeler convert IN.exr -o OUT.exr --as ldi writes one")
    part = 0
    while image.seek_subimage(part, 0):
        spec = image.spec()
        part += 1
        if not spec.getattribute("oiio:subimagename").startswith("layer_"):
            continue
        pixels = image.read_image(part - 1, 0, 0, spec.nchannels, oiio.FLOAT)
        channel = {name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)}
        rows, columns = np.nonzero(channel["Z"] < np.inf)  # a finite Z marks a fragment
        rgba = np.stack([channel[c][rows, columns] for c in "RGBA"], axis=1)
        camera = json.loads(spec.getattribute("peeler:cameraJson"))
        yield camera, columns + spec.x, rows + spec.y, channel["Z"][rows, columns], rgba


def unproject(camera, x, y, z):
    """Returns the world-space points (n, 3) at the centres of the pixels (x, y) and at the camera depths z."""
    z = z.astype(np.float64)
    scale = z if camera["projection"] == "perspective" else 1
    right = camera["halfWidth"] * (2 * (x + 0.5) / camera["width"] - 1) * scale
    up = camera["halfHeight"] * (1 - 2 * (y + 0.5) / camera["height"]) * scale
    return np.stack([right, up, -z, np.ones_like(z)], axis=1) @ np.array(
        camera["cameraToWorld"]).T[:, :3]


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
    clouds = [unproject(*layer[:4]) for layer in layers(sys.argv[1])]
    describe(np.concatenate(clouds) if clouds else np.empty((0, 3)))
