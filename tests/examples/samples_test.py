# SPDX-License-Identifier: Apache-2.0
"""Tests training samples by reading them in the usual ways: with torch if it is installed, otherwise with numpy."""

import json
import pathlib
import tempfile
import unittest

import numpy as np
from peeler_command import EXAMPLES, PeelerTest, main, peeler
from PIL import Image

try:
    import torch
except ImportError:
    torch = None

SCENES = [EXAMPLES / "scenes" / f"{name}.glb" for name in ("coincident", "plant")]
VIEWS = 3


def tensor(array):
    return torch.from_numpy(array).numpy() if torch else array


class Samples(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def made(self, *arguments):
        done = peeler("render", *arguments, "--json", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_lari(self):
        """Tests the description in formats/README.md, "Samples for LaRI and X-Ray": a picture, depths of layers, and a
        pose, for a model in the unit cube and a focal length of 35/32 of the width."""
        self.made(*SCENES, "-o", self.folder / "{stem}_@@@.png", "--preset", "lari", "--views", VIEWS, "--size",
                  "96x96")
        for scene in SCENES:
            for view in range(VIEWS):
                stem = self.folder / f"{scene.stem}_{view:03}"
                picture = np.array(Image.open(f"{stem}.png"))
                layers = tensor(np.load(f"{stem}_ldi.npz")["ldi"])
                pose = tensor(np.load(f"{stem}.npy"))
                self.assertEqual((picture.shape, layers.shape, pose.shape), ((96, 96, 4), (96, 96, 15), (3, 4)))
                self.assertEqual(layers.dtype, np.float16)
                there = layers != -1
                # LaRI's own check, with a threshold of 0: the mask of the picture equals that of the first layer.
                np.testing.assert_array_equal(picture[..., :3].sum(-1) > 0, there[..., 0])
                np.testing.assert_array_equal(picture[..., 3] > 0, there[..., 0])
                self.assertTrue(np.all(there[..., 1:] <= there[..., :-1]))
                depth = np.where(there, layers, np.inf).astype(float)
                self.assertTrue(np.all(depth[..., 1:] >= depth[..., :-1]))
                # In Blender's world, with +Z up, no point is outside the unit cube.
                rows, columns = np.nonzero(there[..., 0])
                z = layers[rows, columns, 0].astype(float)
                focal = 96 * 35 / 32
                seen = np.stack([(columns + 0.5 - 48) / focal * z, -(rows + 0.5 - 48) / focal * z, -z])
                world = np.linalg.inv(pose[:, :3]) @ (seen - pose[:, 3:])
                self.assertLess(np.abs(world).max(), 0.5 + 2e-3)

    def test_planes_are_those_of_the_lists(self):
        """Tests every view, and rays without GL."""
        shared = ("--views", VIEWS, "--size", "80x60", "--channels", "position,normal,facing,id")
        self.made(SCENES[1], "-o", self.folder / "list@.npz", *shared)
        self.made(SCENES[1], "-o", self.folder / "plane@.npz", *shared, "--dense", 4)
        for view in range(VIEWS):
            lists, planes = (np.load(self.folder / f"{kind}000{view}.npz") for kind in ("list", "plane"))
            splits = lists["ray_splits"]
            np.testing.assert_array_equal(planes["count"].ravel(), np.diff(splits))
            self.assertGreater(planes["count"].max(), 4)
            for layer in range(4):
                pixels = np.flatnonzero(np.diff(splits) > layer)
                for name in ("z", "positions", "normals", "node_ids", "rgba"):
                    plane = planes[name][:, :, layer].reshape(len(splits) - 1, *lists[name].shape[1:])
                    expected = lists[name][splits[pixels] + layer]
                    np.testing.assert_array_equal(plane[pixels], expected.astype(plane.dtype), f"{name} {layer}")
        done = peeler("rays", SCENES[1], "-o", self.folder / "hits@.npz", "--views", VIEWS, "--size", "80x60",
                      "--engine", "cpu", "--dense", 4, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(np.load(self.folder / "hits0002.npz")["t_hit"].shape, (60, 80, 4))


if __name__ == "__main__":
    if not torch:
        print("without python3-torch: the same by numpy")
    raise SystemExit(main())
