# SPDX-License-Identifier: Apache-2.0
"""Tests cameras of other programs. For every camera format, OpenCV projects the positions of layers to their pixels.
COLMAP reads our files, and peeler reads COLMAP's."""

import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
from peeler_command import EXAMPLES, PeelerTest, main, peeler

try:
    import cv2
except ImportError:
    cv2 = None
COLMAP = shutil.which("colmap")

SCENE = EXAMPLES / "scenes" / "coincident.glb"
SIZE = (150, 110)
# An off-centre camera with non-square pixels. As in OpenCV, (0, 0) is the centre of the first pixel.
K = np.array([[180.0, 0, 61.25], [0, 205.5, 70.5], [0, 0, 1]])
NEAREST = 1e-3  # the largest error of a projection, in pixels


def looking(eye, target, up=(0, 1, 0)):
    """Returns the matrix from world to camera, in OpenCV's axes: x right, y down, z forward."""
    forward = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = -turn @ np.asarray(eye, float)
    return matrix


VIEWS = [looking((0.5, 0.6, 0.9), (0.02, 0.05, 0)), looking((-0.7, 0.4, 0.5), (0, 0.1, 0))]
# FLIP converts between OpenCV's and OpenGL's camera axes; BLENDER converts to Blender's world, with +Z up.
FLIP = np.diag([1.0, -1, -1, 1])
BLENDER = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def opengl(view):
    """Returns the matrix from camera to world, for a camera that looks along -Z."""
    return np.linalg.inv(view) @ FLIP


def quaternion(turn):
    """Returns w, x, y, z for a rotation by less than half a turn."""
    w = np.sqrt(1 + np.trace(turn)) / 2
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    return [w, x / (4 * w), y / (4 * w), z / (4 * w)]


def write_transforms(folder):
    frames = [{"file_path": f"images/{i}.png", "transform_matrix": opengl(view).tolist()}
              for i, view in enumerate(VIEWS)]
    lens = {"fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2] + 0.5, "cy": K[1, 2] + 0.5, "w": SIZE[0], "h": SIZE[1]}
    (folder / "transforms.json").write_text(json.dumps({**lens, "frames": frames}))
    return [folder / "transforms.json"]


def write_bop(folder):
    cameras = {i: {"cam_K": K.ravel().tolist(), "cam_R_w2c": view[:3, :3].ravel().tolist(),
                   "cam_t_w2c": (1000 * view[:3, 3]).tolist(), "depth_scale": 1} for i, view in enumerate(VIEWS)}
    (folder / "scene_camera.json").write_text(json.dumps(cameras))
    (folder / "camera.json").write_text(json.dumps({"width": SIZE[0], "height": SIZE[1]}))
    return [folder / "scene_camera.json"]


def write_colmap(folder):
    (folder / "cameras.txt").write_text(
        f"1 PINHOLE {SIZE[0]} {SIZE[1]} {K[0, 0]} {K[1, 1]} {K[0, 2] + 0.5} {K[1, 2] + 0.5}\n")
    lines = []
    for i, view in enumerate(VIEWS):
        numbers = [*quaternion(view[:3, :3]), *view[:3, 3]]
        lines += [f"{i + 1} {' '.join(map(repr, map(float, numbers)))} 1 {i}.png", ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    (folder / "points3D.txt").write_text("")
    return [folder]


def write_lines(folder):
    lines = [json.dumps({"name": str(i), "size": SIZE, "K": K.tolist(), "worldToCamera": view.tolist()})
             for i, view in enumerate(VIEWS)]
    (folder / "views.jsonl").write_text("\n".join(lines) + "\n")
    return [folder / "views.jsonl"]


def array_writer(convention, pose):
    def write(folder):
        np.savez(folder / "views.npz", poses=np.stack([pose(view) for view in VIEWS]), K=K, size=SIZE)
        return [folder / "views.npz", "--camera-convention", convention]

    return write


FORMATS = {
    "transforms.json": write_transforms,
    "BOP": write_bop,
    "COLMAP": write_colmap,
    "lines": write_lines,
    "opencv": array_writer("opencv", lambda view: view[:3]),
    "opengl": array_writer("opengl", opengl),
    "blender": array_writer("blender", lambda view: BLENDER @ opengl(view)),
}


class Cameras(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def made(self, arguments):
        """Renders the layers of the views; returns one NumPy archive per view."""
        self.render(SCENE, "-o", self.folder / "@.npz", "--channels", "position", *arguments)
        return [np.load(self.folder / f"000{i}.npz") for i in range(len(VIEWS))]

    def assert_pixels(self, arrays, view):
        """Expects every position to project to its own pixel."""
        splits, (x0, y0, width, _) = arrays["ray_splits"], arrays["bundle_window"][0]
        pixels = np.repeat(np.arange(len(splits) - 1), np.diff(splits))
        self.assertGreater(len(pixels), 2000)
        expected = np.stack([pixels % width, pixels // width], axis=1)
        positions = arrays["positions"].astype(float)
        turn, _ = cv2.Rodrigues(view[:3, :3])
        projected, _ = cv2.projectPoints(positions, turn, view[:3, 3], K, None)
        return np.abs(projected[:, 0] - expected).max()

    @unittest.skipUnless(cv2, "no python3-opencv")
    def test_positions_are_projected_into_their_pixels(self):
        for name, write in FORMATS.items():
            folder = self.folder / name.replace(".", "_")
            folder.mkdir()
            with self.subTest(name):
                farthest = max(
                    self.assert_pixels(arrays, view)
                    for arrays, view in zip(self.made(["--cameras", *write(folder)]), VIEWS)
                )
                print(f"{name}: at most {farthest:.2e} pixels")
                self.assertLess(farthest, NEAREST)

    def test_formats_agree(self):
        """The same camera gives the same layers in every format, except for rounding."""
        reference = None
        for name, write in FORMATS.items():
            folder = self.folder / name.replace(".", "_")
            folder.mkdir()
            arrays = self.made(["--cameras", *write(folder)])[1]
            if reference is None:
                reference = arrays
            self.assertEqual(len(arrays["z"]), len(reference["z"]), name)
            self.assertLess(np.abs(arrays["z"] - reference["z"]).max(), 1e-6, name)

    @unittest.skipUnless(COLMAP, "no colmap")
    def test_colmap_reads_and_is_read(self):
        model = self.folder / "model"
        self.render(SCENE, "-o", self.folder / "v@.png", "--views", 5, "--size", "120x90", "--cameras-out", f"{model}/")
        told = subprocess.run([COLMAP, "model_analyzer", "--path", model], text=True, check=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={"QT_QPA_PLATFORM": "offscreen",
                                                                                     "HOME": str(self.folder)}).stdout
        self.assertRegex(told, r"Cameras: [15]\b")
        self.assertRegex(told, r"Images: 5\b")
        self.assertGreater(int(re.search(r"Points: (\d+)", told)[1]), 1000)
        # COLMAP converts our model to text. The text must have the same poses.
        text = self.folder / "text"
        text.mkdir()
        subprocess.run([COLMAP, "model_converter", "--input_path", model, "--output_path", text, "--output_type", "TXT"],
                       check=True, capture_output=True, env={"QT_QPA_PLATFORM": "offscreen", "HOME": str(self.folder)})
        poses = []
        for source in (model, text):
            out = self.folder / f"{source.name}.json"
            self.render(SCENE, "-o", self.folder / "w@.png", "--cameras", source, "--cameras-out", out)
            poses.append(np.array([frame["transform_matrix"] for frame in json.loads(out.read_text())["frames"]]))
        self.assertEqual(poses[0].shape, (5, 4, 4))
        self.assertLess(np.abs(poses[0] - poses[1]).max(), 1e-5)

    def test_refused(self):
        (self.folder / "sheared.jsonl").write_text('{"size": [9, 9], "K": [[9, 1, 4], [0, 9, 4], [0, 0, 1]], '
                                                   '"eye": [1, 1, 1], "target": [0, 0, 0]}\n')
        with (self.folder / "large.json").open("wb") as file:
            file.truncate(2 << 30)  # a sparse file, which occupies no space
        np.save(self.folder / "nan.npy", np.full((1, 3, 4), np.nan))
        np.save(self.folder / "poses.npy", np.stack([view[:3] for view in VIEWS]))
        for file, more, code, told in (
            ("sheared.jsonl", (), 3, "skew"),
            ("large.json", (), 3, "large.json"),
            ("nan.npy", ("--camera-convention", "opencv"), 3, "nan.npy"),
            ("poses.npy", (), 2, "--camera-convention"),
        ):
            done = peeler("render", SCENE, "-o", self.folder / "@.png", "--cameras", self.folder / file, *more)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(told, done.stderr)
        self.assertEqual(list(self.folder.glob("*.png")), [])


if __name__ == "__main__":
    for missing, what in ((not cv2, "python3-opencv"), (not COLMAP, "colmap")):
        if missing:
            print(f"left out, for want of {what}")
    raise SystemExit(main())
