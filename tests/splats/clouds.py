# SPDX-License-Identifier: Apache-2.0
"""Clouds of splats, their files, peeler's fragments of them, and how these differ from the reference."""

import json
import os
import pathlib
import struct
import subprocess
import sys

import numpy as np
import reference
from reference import Camera, Cloud

SOURCE = pathlib.Path(__file__).resolve().parents[2]
GUITAR = pathlib.Path(os.environ.get("PEELER_SPLATS") or SOURCE.parent / "shared" / "splats") / "guitar.compressed.ply"
CLOSE = 1e-5  # of depths, opacities and colours; relative where they exceed 1


def skip(reason):
    print(f"skipped: {reason}", flush=True)
    sys.exit(77)


def random_cloud(random, count, degree, scales=None, box=(2, 1.5, 3)):
    """Returns splats in a box around the origin. `scales` (3,) applies to all of them."""
    if scales is None:
        scales = 0.01 * np.exp(3 * random.random((count, 3)))
    return Cloud((random.random((count, 3)) - 0.5) * box, np.broadcast_to(scales, (count, 3)),
                 random.normal(size=(count, 4)), random.random(count),
                 0.2 * random.normal(size=(count, (degree + 1) ** 2, 3)))


def joined(*clouds):
    return Cloud(*(np.concatenate(arrays) for arrays in zip(*(cloud[:5] for cloud in clouds))))


def write_ply(path, cloud):
    """Writes a 3DGS PLY. Returns the cloud as the file's floats state it."""
    count, coefficients = cloud.harmonics.shape[:2]
    names = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 opacity f_dc_0 f_dc_1 f_dc_2".split()
    names += [f"f_rest_{i}" for i in range(3 * (coefficients - 1))]
    head = ["ply", "format binary_little_endian 1.0", *["comment SplatRenderMode: mip"] * cloud.compensated,
            f"element vertex {count}", *(f"property float {name}" for name in names), "end_header\n"]
    logits = np.log(cloud.opacities / (1 - cloud.opacities))
    rows = np.concatenate([cloud.means, np.log(cloud.scales), cloud.turns, logits[:, None], cloud.harmonics[:, 0],
                           cloud.harmonics[:, 1:].transpose(0, 2, 1).reshape(count, -1)], 1)
    path.write_bytes("\n".join(head).encode() + rows.astype("<f4").tobytes())
    return reference.read_ply(path)


def write_gltf(path, cloud, matrix=np.eye(4)):
    """Writes a GLB (KHR_gaussian_splatting) of one node with this matrix."""
    unit = cloud.turns[:, [1, 2, 3, 0]] / np.linalg.norm(cloud.turns, axis=1, keepdims=True)
    arrays = {"POSITION": cloud.means, "ROTATION": unit, "SCALE": cloud.scales, "OPACITY": cloud.opacities[:, None]}
    for k in range(cloud.harmonics.shape[1]):
        degree = int(k**0.5)
        arrays[f"SH_DEGREE_{degree}_COEF_{k - degree**2}"] = cloud.harmonics[:, k]
    body, views, accessors, attributes = b"", [], [], {}
    for name, array in arrays.items():
        data = array.astype("<f4")
        attributes[name if name == "POSITION" else f"KHR_gaussian_splatting:{name}"] = len(views)
        accessors.append({"bufferView": len(views), "componentType": 5126, "count": len(data),
                          "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[data.shape[1]],
                          "min": data.min(0).tolist(), "max": data.max(0).tolist()})
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": data.nbytes})
        body += data.tobytes()
    extension = {"KHR_gaussian_splatting": {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}
    text = json.dumps({
        "asset": {"version": "2.0"}, "extensionsUsed": list(extension), "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "matrix": np.asarray(matrix, float).T.ravel().tolist()}],
        "meshes": [{"primitives": [{"attributes": attributes, "mode": 0, "extensions": extension}]}],
        "buffers": [{"byteLength": len(body)}], "bufferViews": views, "accessors": accessors}).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(body), len(text), 0x4E4F534A) + text +
                     struct.pack("<II", len(body), 0x004E4942) + body)


def look(eye, target=(0, 0, 0), up=(0, 1, 0), focal=60, size=(80, 60), **more):
    """Returns a camera at a point."""
    forward = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    turn = np.stack([right, np.cross(forward, right), forward])
    return Camera(np.column_stack([turn, -turn @ eye]), np.full(2, float(focal)), size, **more)


def options(camera):
    """Returns the options that give peeler this camera, with all its digits."""
    numbers = lambda values: ",".join(repr(float(v)) for v in values)  # noqa: E731
    width, height = camera.size
    return ["--size", f"{width}x{height}", "--pose", numbers(camera.pose.ravel()), "--near", str(camera.near),
            *(["--ortho-height", repr(float(height / camera.focal[1]))] if camera.parallel else
              ["--intrinsics", numbers([*camera.focal, *(camera.middle - 0.5)])])]


def render(scene, out, *words):
    done = subprocess.run([os.environ["PEELER"], "render", scene, "-o", out, "--precision", "float", "--quiet", *words],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)


class Captured:
    """All fragments that peeler finds, nearest first in each pixel: splat, pixel, z, alpha, color (premultiplied)."""

    def __init__(self, scene, camera, folder, *words):
        out = folder / "fragments.npz"
        render(scene, out, "--as", "arrays", "--channels", "id", *options(camera), *words)
        arrays = np.load(out)
        self.splits = arrays["ray_splits"]
        self.pixel = np.repeat(np.arange(len(self.splits) - 1), np.diff(self.splits))
        self.splat, self.z = arrays["primitive_ids"].astype(int), arrays["z"]
        self.color, self.alpha = arrays["rgba"][:, :3], arrays["rgba"][:, 3]


def matched(test, one, other):
    """Returns the indices of the fragments that two captures have in common: the same splat in the same pixel. Expects
    all of them, except a few that rounding puts on the other side of a cut."""
    keys = [found.pixel << 32 | found.splat for found in (one, other)]
    common, *indices = np.intersect1d(*keys, return_indices=True)
    test.assertLessEqual(max(map(len, keys)) - len(common), 1e-5 * len(common), "fragments of one capture only")
    return indices


def far_apart(ours, theirs):
    """Returns the largest difference, relative where values exceed 1."""
    return float((np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1)).max(initial=0))


def compare(test, captured, cloud, camera, dilation, order="z", stored=False):
    """Compares all fragments with the reference's. Returns the largest differences (z, alpha, color) and the
    picture (height, width, 4) of the reference's values: in linear light, or of colours as they are stored."""
    found = reference.fragments(cloud, camera, dilation, order)
    margin, alpha, z = (array.reshape(len(cloud.means), -1) for array in (found.margin, found.alpha, found.z))
    ours = np.zeros(margin.shape, bool)
    ours[captured.splat, captured.pixel] = True
    test.assertEqual(ours.sum(), len(captured.pixel), "fragments of one splat in one pixel")
    # Rounding may decide about fragments at a cut, and only about those.
    wrong = (ours != (margin >= 0)) & ~(np.abs(margin) < CLOSE)
    test.assertFalse(wrong.any(), f"fragments (splat, pixel) that differ: {np.argwhere(wrong)[:8].tolist()}")

    at = captured.splat, captured.pixel
    color = reference.linear(reference.colors(cloud, camera))
    first = np.zeros(len(captured.pixel), bool)
    first[captured.splits[:-1][np.diff(captured.splits) > 0]] = True
    # The order is the reference's, except at depths that differ by rounding; at one depth it is the file's.
    steps = np.diff(z[at]) / np.maximum(z[at][1:], 1)
    test.assertGreater(steps[~first[1:]].min(initial=0), -CLOSE, "order")
    ties = ~first[1:] & (np.diff(captured.z) <= 0)
    test.assertTrue((np.diff(captured.splat)[ties] > 0).all(), "order of equal depths")
    pixels = [slice(*pair) for pair in zip(captured.splits[:-1], captured.splits[1:])]
    shown = reference.colors(cloud, camera) if stored else color
    picture = np.stack([reference.over(alpha[captured.splat[part], p], shown[captured.splat[part]])
                        for p, part in enumerate(pixels)])
    apart = (far_apart(captured.z, z[at]), far_apart(captured.alpha, alpha[at]),
             far_apart(captured.color, color[captured.splat] * alpha[at][:, None]))
    for what, value in zip(("z", "alpha", "color"), apart):
        test.assertLess(value, CLOSE, what)
    return apart, picture.reshape(camera.size[1], camera.size[0], 4)

