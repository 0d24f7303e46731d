# SPDX-License-Identifier: Apache-2.0
"""Tests the readers of Gaussian splats with a witness: PlayCanvas' splat-transform converts between the formats. Its
decoded PLY of a compressed file must show as peeler shows that file. The real capture is $PEELER_SPLATS (default:
../shared/splats)/guitar.compressed.ply.

    python3 formats_test.py FOLDER_OF_THE_PROGRAM
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import reference
from clouds import CLOSE, GUITAR, Captured, far_apart, look, matched, random_cloud, write_ply
from splat_transform import install, run

# From the PLY's axes to those that the formats are written in.
TURNS = {"glb": np.diag([-1.0, -1, 1, 1]), "spz": np.diag([1.0, -1, -1, 1])}
CAMERA = look((0.3, -2, 4.5), (0, -2, 0), (0, -1, 0))
CAMERAS = (CAMERA, CAMERA._replace(parallel=True, focal=np.full(2, 12.0)))


def turned(camera, path):
    pose = np.vstack([camera.pose, [0, 0, 0, 1]]) @ TURNS.get(path.suffix[1:], np.eye(4))  # each is its own inverse
    return camera._replace(pose=pose[:3])


class Formats(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.random = np.random.default_rng(3)

    def convert(self, source, name, *words):
        run(PROGRAM, *words, source, self.folder / name)
        return self.folder / name

    def expect_equal(self, one, other):
        """Expects the same fragments: the same bytes of Z (along parallel rays, where all formats are sorted by Z), and
        the same opacities and colours but for rounding."""
        for camera in CAMERAS:
            first, second = (Captured(path, turned(camera, path), self.folder, "--splat-dilation", "0.3")
                             for path in (one, other))
            self.assertGreater(len(first.pixel), 10000)
            first_at, second_at = matched(self, first, second)
            apart = [far_apart(getattr(first, name)[first_at], getattr(second, name)[second_at])
                     for name in ("alpha", "color")]
            print("{} and {}: {} fragments; opacities differ by {:.1e}, colours by {:.1e}".format(
                one.name, other.name, len(first.pixel), *apart))
            self.assertLess(max(apart), CLOSE)
            if camera.parallel:
                self.assertEqual(first.z[first_at].tobytes(), second.z[second_at].tobytes())

    def check(self, source):
        plain = self.convert(source, "plain.ply")
        self.expect_equal(source, plain)
        self.expect_equal(plain, self.convert(source, "plain.glb"))
        decoded = []
        for name, *words in (("small.compressed.ply",), ("small.spz", "--spz-version", "3")):
            small = self.convert(source, name, *words)
            decoded.append(self.convert(small, f"{name}.decoded.ply"))
            self.expect_equal(small, decoded[-1])
        return decoded

    def test_a_real_capture(self):
        if not GUITAR.is_file():
            self.skipTest(f"{GUITAR} is not there (PEELER_SPLATS)")
        self.check(GUITAR)

    def test_harmonics(self):
        """Also tests that the compressed files hold the original, to half a step of their integers."""
        cloud = random_cloud(self.random, 2000, 3)
        cloud.means[:] -= [0, 2, 0]
        original = write_ply(self.folder / "source.ply", cloud)
        compressed, spz = map(reference.read_ply, self.check(self.folder / "source.ply"))

        # compressed.ply: 11, 10, 11 bits between the limits of 256 splats; opacities and colours 8 bits; harmonics 8
        # bits from -4 to 4. Scales are logarithms.
        order = self.nearest(compressed, original)
        levels = 2 * (2.0 ** np.array([11, 10, 11]) - 1)
        steps = {"means": self.ranges(original.means[order]) / levels,
                 "scales": self.ranges(np.log(original.scales[order])) / levels, "opacities": 1 / 510,
                 "first": self.ranges(original.harmonics[order, 0]) / 510, "rest": 8 / 512}
        self.expect_within(compressed, original, order, steps)
        # SPZ: 12 bits behind the point; logarithms of scales 16 steps a unit; opacities 8 bits; colours 8 bits of 0.15
        # times the coefficient; harmonics 5 bits (degree 1) and 4 bits (others) from -1 to 1.
        bits = np.repeat([5, 4, 4], [3, 5, 7])[:, None]
        self.expect_within(spz, original, self.nearest(spz, original), {
            "means": 2.0**-13, "scales": 1 / 32, "opacities": 1 / 510, "first": 1 / (510 * 0.15),
            "rest": 2.0 ** -bits + 1 / 128})

    def nearest(self, found, original):
        """Returns the original's index of each splat: converters may reorder splats."""
        away = ((found.means[:, None] - original.means) ** 2).sum(-1)
        order = away.argmin(1)
        self.assertEqual(len(set(order)), len(order))
        return order

    @staticmethod
    def ranges(values):
        chunks = [values[i:i + 256] for i in range(0, len(values), 256)]
        return np.concatenate([np.broadcast_to(np.ptp(chunk, axis=0), chunk.shape) for chunk in chunks])

    def expect_within(self, found, original, order, half_steps):
        of = {"means": lambda c: c.means, "scales": lambda c: np.log(c.scales), "opacities": lambda c: c.opacities,
              "first": lambda c: c.harmonics[:, 0], "rest": lambda c: c.harmonics[:, 1:]}
        shares = {name: float((np.abs(of[name](found) - of[name](original)[order]) / half).max())
                  for name, half in half_steps.items()}
        print("differences in half steps:", {name: round(share, 3) for name, share in shares.items()})
        for name, share in shares.items():
            self.assertLess(share, 1.001, name)

    def test_dot_splat(self):
        """splat-transform reads .splat, but does not write it. It takes a byte b of a rotation as 2 b / 255 - 1, peeler
        as b / 128 - 1, as the format's author does. So only balls show exactly the same."""
        cloud = random_cloud(self.random, 2000, 0)
        cloud.means[:] -= [0, 2, 0]
        unit = cloud.turns / np.linalg.norm(cloud.turns, axis=1, keepdims=True)
        bytes_of = lambda share: np.clip(np.round(share), 0, 255).astype(np.uint8)  # noqa: E731
        rows = np.zeros(2000, [("mean", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("turn", "u1", 4)])
        rows["mean"], rows["turn"] = cloud.means, bytes_of(128 + 128 * unit)
        rows["color"][:, :3] = bytes_of(255 * (0.5 + 0.28209479 * cloud.harmonics[:, 0]))
        rows["color"][:, 3] = bytes_of(255 * np.clip(cloud.opacities, 0.01, 0.99))
        ours = self.folder / "cloud.splat"
        rows["scale"] = cloud.scales[:, :1]
        ours.write_bytes(rows.tobytes())
        self.expect_equal(ours, self.convert(ours, "decoded.ply"))

        rows["scale"] = cloud.scales
        ours.write_bytes(rows.tobytes())
        both = [Captured(path, CAMERA, self.folder) for path in (ours, self.convert(ours, "decoded.ply"))]
        alphas = [np.zeros((2000, len(found.splits) - 1)) for found in both]
        for alpha, found in zip(alphas, both):
            alpha[found.splat, found.pixel] = found.alpha
        apart = np.abs(alphas[0] - alphas[1])[(alphas[0] > 0) | (alphas[1] > 0)]
        print(f"ellipsoids of .splat: opacities differ by {apart.mean():.1e} on average")
        self.assertLess(apart.mean(), 5e-3)

    def test_formats_that_are_refused(self):
        write_ply(self.folder / "source.ply", random_cloud(self.random, 100, 0))
        for name, says, hint in (("cloud.sog", "SOG splats are not supported", "convert them to PLY, SPZ 3 or glTF"),
                                 ("cloud.spz", "SPZ version 4 is not supported", "convert it to SPZ 3, glTF or PLY")):
            path = self.convert(self.folder / "source.ply", name)
            done = subprocess.run([os.environ["PEELER"], "info", path], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout), (3, ""), done.stderr)
            self.assertIn(says, done.stderr)
            self.assertIn(hint, done.stderr)


if __name__ == "__main__":
    PROGRAM = install(sys.argv.pop(1))
    unittest.main()
