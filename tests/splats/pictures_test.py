# SPDX-License-Identifier: Apache-2.0
"""Compares the reference (reference.py) with pictures of another renderer: PlayCanvas' splat-transform, whose WebGPU
runs on a CPU through Mesa's lavapipe. Debian 12's Mesa lacks features, so the driver of its backports is unpacked.

    python3 pictures_test.py FOLDER_OF_THE_PROGRAM
"""

import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import reference
from clouds import GUITAR, look, random_cloud, skip, write_ply
from splat_transform import install, run

try:
    import OpenImageIO as oiio
except ImportError:
    skip("Debian's python3-openimageio is missing")

NEAR = 0.2  # splat-transform's
FLOOR = np.exp(-(reference.REACH**2) / 2)
END = 1e-4  # transmittance at which it stops
TURN = np.diag([-1.0, -1, 1, 1])  # it turns a PLY by 180 degrees about Z


def driver(folder):
    """Returns the environment in which Vulkan runs on the CPU: unpacks Debian's packages into a folder."""
    manifests = lambda: sorted(folder.rglob("icd.d/lvp_icd*.json"))  # noqa: E731
    if not manifests():
        name = platform.freedesktop_os_release().get("VERSION_CODENAME")
        suites = {"bookworm": ("bookworm", "bookworm-backports"), "trixie": ("trixie",)}.get(name)
        if not suites:
            skip(f"no Mesa 25 is known for {name}")
        for part in ("lists/partial", "cache/archives/partial"):
            (folder / part).mkdir(parents=True, exist_ok=True)
        (folder / "sources.list").write_text("".join(
            "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian "
            f"{suite} main\n" for suite in suites))
        apt = ["apt-get", "-q", "-o", f"Dir::Etc::SourceList={folder}/sources.list", "-o",
               "Dir::Etc::SourceParts=/dev/null", "-o", f"Dir::State::Lists={folder}/lists", "-o",
               f"Dir::Cache={folder}/cache", "-o", "APT::Sandbox::User=root", "-o", "Debug::NoLocking=1"]
        for words in (["update"], ["install", "--download-only", "--yes", "--reinstall", "--no-install-recommends",
                                   "-t", suites[-1], "mesa-vulkan-drivers", "libvulkan1"]):
            done = subprocess.run(apt + words, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                skip(f"apt-get {words[0]} of Mesa's Vulkan drivers failed: {done.stderr.strip()[-300:]}")
        for package in (folder / "cache" / "archives").glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", package, folder / "root"], check=True)
        for part in ("lists", "cache"):
            shutil.rmtree(folder / part)
    libraries = manifests()[0].parents[3] / "lib" / f"{platform.machine()}-linux-gnu"
    return {**os.environ, "VK_DRIVER_FILES": str(manifests()[0]), "VK_ICD_FILENAMES": str(manifests()[0]),
            "LD_LIBRARY_PATH": str(libraries)}


def picture(cloud, camera):
    """Returns what splat-transform draws, (height, width, 3) in display space. It differs from the paper's code in that
    opacities fall to 0 at 3 standard deviations."""
    splats, colors = reference.project(cloud, camera, 0.3), reference.colors(cloud, camera)
    inverse = np.linalg.inv(splats.covariances)
    reach = reference.REACH * np.sqrt(splats.covariances[:, [0, 1], [0, 1]])
    width, height = camera.size
    image, through = np.zeros((height, width, 3)), np.ones((height, width))
    for i in np.argsort(splats.at[:, 2], kind="stable"):
        low = np.maximum(np.ceil(splats.means[i] - reach[i] - 0.5), 0).astype(int)
        high = np.minimum(np.floor(splats.means[i] + reach[i] - 0.5) + 1, (width, height)).astype(int)
        if not splats.at[i, 2] > NEAR or (low >= high).any():
            continue
        box = slice(low[1], high[1]), slice(low[0], high[0])
        x = np.arange(low[0], high[0]) + 0.5 - splats.means[i, 0]
        y = np.arange(low[1], high[1])[:, None] + 0.5 - splats.means[i, 1]
        (xx, xy), (_, yy) = inverse[i]
        response = np.exp(-0.5 * (xx * x * x + yy * y * y) - xy * x * y)
        alpha = np.minimum(reference.MOST, splats.opacities[i] * np.maximum(response - FLOOR, 0))
        alpha *= (alpha >= reference.LEAST) & (through[box] >= END)
        image[box] += (through[box] * alpha)[..., None] * colors[i]
        through[box] *= 1 - alpha
    return image


class Pictures(unittest.TestCase):
    def check(self, scene, cloud, eye, target, size):
        """Compares a picture from a point of splat-transform's world."""
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "picture.webp"
            numbers = lambda values: ",".join(map(str, values))  # noqa: E731
            run(PROGRAM, scene, out, "--camera", numbers(eye), "--look-at", numbers(target), "--fov", "60",
                "--resolution", "{}x{}".format(*size), env=ENVIRONMENT)
            theirs = oiio.ImageBuf(str(out)).get_pixels(oiio.UINT8).astype(int)[..., :3]
        camera = look(eye, target, focal=size[1] / 2 / np.tan(np.radians(30)), size=size, near=NEAR)
        pose = np.vstack([camera.pose, [0, 0, 0, 1]]) @ TURN
        ours = np.round(255 * np.clip(picture(cloud, camera._replace(pose=pose[:3])), 0, 1)).astype(int)
        self.assertEqual(ours.shape, theirs.shape)
        self.assertGreater((theirs > 32).mean(), 0.05)
        apart = np.abs(ours - theirs)
        print(f"{scene.name}, {size[0]}x{size[1]}: {(apart == 0).mean():.4%} of the values are equal, "
              f"{(apart == 1).mean():.4%} differ by 1/255, {(apart > 1).mean():.4%} by more, at most {apart.max()}/255")
        self.assertLessEqual(apart.max(), 1)
        self.assertGreater((apart == 0).mean(), 0.99)

    def test_a_real_capture(self):
        if not GUITAR.is_file():
            self.skipTest(f"{GUITAR} is not there (PEELER_SPLATS)")
        with tempfile.TemporaryDirectory() as folder:
            plain = pathlib.Path(folder) / "plain.ply"
            run(PROGRAM, GUITAR, plain)
            cloud = reference.read_ply(plain)
            for size in ((640, 480), (320, 240)):
                self.check(plain, cloud, (0.4, 2.4, 2.5), (0, 2, 0), size)

    def test_harmonics(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "cloud.ply"
            cloud = write_ply(scene, random_cloud(np.random.default_rng(5), 2000, 3))
            for size in ((640, 480), (320, 240)):
                self.check(scene, cloud, (0.5, 0.7, 3.5), (0, 0, 0), size)


if __name__ == "__main__":
    FOLDER = pathlib.Path(sys.argv.pop(1)).resolve()
    PROGRAM, ENVIRONMENT = install(FOLDER), driver(FOLDER / "mesa")
    unittest.main()
