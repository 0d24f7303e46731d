# SPDX-License-Identifier: Apache-2.0
"""Compares every fragment of Gaussian splats, and composites, with a reference in double precision (reference.py).
PEELER_TEST_ALL takes more scenes and larger pictures."""

import itertools
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import reference
from clouds import (CLOSE, Captured, compare, far_apart, joined, look, matched, options, random_cloud, render, skip,
                    write_gltf, write_ply)

try:
    import OpenImageIO as oiio
except ImportError:
    skip("Debian's python3-openimageio is missing")

ALL = bool(os.environ.get("PEELER_TEST_ALL"))
METHODS = ("front-to-back", "two-pass", "back-to-front", "dual", "dual-max")
CAMERAS = {"perspective": look((0.5, 0.3, 3.5)), "parallel": look((-0.4, 0.6, 3.5), focal=24, parallel=True)}
# Dilation: of the file's format, which is 0.3, 0, or more. One per degree of harmonics in the short run.
DILATIONS = (None, 0, 2, 0.1)


def read_image(path, kind):
    """Reads an image. (An ImageBuf may return an earlier file of this name.)"""
    image = oiio.ImageInput.open(str(path))
    return image.read_image(0, 0, 0, image.spec().nchannels, kind)


class Reference(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.random = np.random.default_rng(49)

    def composite(self, scene, camera, *words):
        render(scene, self.folder / "flat.exr", "--as", "composite", *options(camera), *words)
        return read_image(self.folder / "flat.exr", oiio.FLOAT)

    def check(self, cloud, camera, dilation=None, by_ray=False, least=1000):
        scene = self.folder / "cloud.ply"
        cloud = write_ply(scene, cloud)
        words = ["--splat-order", "ray" if by_ray else "center"]
        if dilation is not None:
            words += ["--splat-dilation", str(dilation)]
        captured = Captured(scene, camera, self.folder, *words)
        self.assertGreater(len(captured.pixel), least)
        apart, picture = compare(self, captured, cloud, camera, 0.3 if dilation is None else dilation,
                                 "ray" if by_ray else "z")
        composite = far_apart(self.composite(scene, camera, *words)[..., :4], picture)
        print(f"{self._testMethodName}{' by ray' * by_ray}: {len(captured.pixel)} fragments differ by at most "
              "{:.1e} (Z), {:.1e} (alpha), {:.1e} (colour), {:.1e} (composite)".format(*apart, composite))
        self.assertLess(composite, CLOSE)
        return captured, picture

    def test_random_splats(self):
        wanted = itertools.product(range(4), DILATIONS, CAMERAS.values(), (False, True))
        short = [(i, DILATIONS[i], CAMERAS["parallel" if i == 2 else "perspective"], i % 2 == 1) for i in range(4)]
        for degree, dilation, camera, by_ray in wanted if ALL else short:
            self.check(random_cloud(self.random, 400 if ALL else 150, degree), camera, dilation, by_ray)

    def test_extreme_splats(self):
        needles = random_cloud(self.random, 20, 1, (0.5, 0.001, 0.001))
        discs = random_cloud(self.random, 20, 1, (0.3, 0.3, 0.02))
        opaque = random_cloud(self.random, 20, 1)._replace(opacities=np.full(20, 1 - 1e-7))
        border = random_cloud(self.random, 40, 1, (0.2, 0.1, 0.3), box=(8, 6, 3))
        near = random_cloud(self.random, 40, 1, (0.05, 0.03, 0.02), box=(2, 2, 7))
        behind = random_cloud(self.random, 10, 1)
        behind.means[:] += [0, 0, 6]
        for by_ray in (False, True):
            self.check(joined(needles, discs, opaque, border, near, behind), CAMERAS["perspective"], by_ray=by_ray)

    def test_splats_thinner_than_a_pixel(self):
        """Without dilation; the needles are 0.2 pixels thin."""
        self.check(random_cloud(self.random, 200, 0, (0.5, 0.012, 0.012)), CAMERAS["perspective"], 0)

    def test_antialiased_training(self):
        small = random_cloud(self.random, 300, 0, 0.01 * np.exp(2 * self.random.random((300, 3))))
        self.check(small._replace(compensated=True), CAMERAS["perspective"])

    def test_a_large_picture(self):
        if not ALL:
            self.skipTest("only with PEELER_TEST_ALL")
        for by_ray in (False, True):
            camera = look((0.5, 0.3, 3.5), focal=240, size=(320, 240))
            self.check(random_cloud(self.random, 100, 3), camera, by_ray=by_ray)

    def test_files(self):
        camera, scene = CAMERAS["perspective"], self.folder / "cloud.ply"
        captured, _ = self.check(random_cloud(self.random, 100, 3), camera, by_ray=True)
        words = [*options(camera), "--splat-order", "ray"]
        width, height = camera.size

        counts = np.diff(captured.splits)
        seen = counts > 0
        nearest = self.composite(scene, camera, "--splat-order", "ray")[..., 4].ravel()[seen]
        np.testing.assert_array_equal(nearest, captured.z[captured.splits[:-1][seen]])

        deep = self.folder / "deep.exr"
        render(scene, deep, "--as", "deep", "--deep-merge", "off", *words)
        found = self.deep_samples(deep, width, height)
        np.testing.assert_array_equal([len(samples) for samples in found], counts)
        np.testing.assert_array_equal(np.concatenate(found),
                                      np.column_stack([captured.color, captured.alpha, captured.z]))

        layers = self.folder / "layers.exr"
        render(scene, layers, *words)
        image = oiio.ImageInput.open(str(layers))
        part, fragments = 1, 0
        while image.seek_subimage(part, 0):
            spec = image.spec()
            pixels = image.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
            y, x = np.nonzero(pixels[..., 4] < np.inf)
            at = captured.splits[(y + spec.y) * width + x + spec.x] + part - 1
            np.testing.assert_array_equal(pixels[y, x], np.column_stack(
                [captured.color[at], captured.alpha[at], captured.z[at]]))
            part, fragments = part + 1, fragments + len(at)
        self.assertEqual(fragments, len(captured.pixel))

    def deep_samples(self, path, width, height):
        """Returns (samples, 5) per pixel: R, G, B, A, Z."""
        file = oiio.ImageInput.open(str(path))
        spec = file.spec()
        self.assertEqual(list(spec.channelnames), ["R", "G", "B", "A", "Z"])
        data = file.read_native_deep_image()
        found = [np.zeros((0, 5))] * (width * height)
        for p in range(spec.width * spec.height):
            at = (p // spec.width + spec.y) * width + p % spec.width + spec.x
            samples = [[data.deep_value(p, c, s) for c in range(5)] for s in range(data.samples(p))]
            found[at] = np.array(samples).reshape(-1, 5)
        return found

    def test_blending_of_displays(self):
        """Composites of stored colours: in a PNG over black, and decoded in an EXR, without a background."""
        camera, scene = CAMERAS["perspective"], self.folder / "cloud.ply"
        cloud = write_ply(scene, random_cloud(self.random, 100, 3))
        captured = Captured(scene, camera, self.folder)
        _, picture = compare(self, captured, cloud, camera, 0.3, stored=True)
        display = ["--splat-blending", "display"]
        render(scene, self.folder / "black.png", "--samples", "1", "--background", "black", *options(camera), *display)
        pixels = read_image(self.folder / "black.png", oiio.UINT8)[..., :3].astype(int)
        apart = np.abs(pixels - 255 * np.clip(picture[..., :3], 0, 1))
        print(f"PNG blended in display space: differs by at most {apart.max():.4f} of 255")
        self.assertLess(apart.max(), 0.5 + 255 * CLOSE)

        composite = self.composite(scene, camera, *display)
        alpha = picture[..., 3:]
        color = np.divide(picture[..., :3], alpha, out=np.zeros_like(picture[..., :3]), where=alpha > 0)
        apart = far_apart(composite[..., :4], np.concatenate([reference.linear(color) * alpha, alpha], -1))
        print(f"EXR blended in display space: differs by at most {apart:.1e}")
        self.assertLess(apart, CLOSE)

    def test_hits_of_rays(self):
        """The rays through the pixels hit the splats of these pixels where they are densest."""
        camera, scene = CAMERAS["perspective"], self.folder / "cloud.ply"
        captured, _ = self.check(random_cloud(self.random, 100, 2), camera, by_ray=True)
        out, (width, height) = self.folder / "hits.npz", camera.size
        subprocess.run([os.environ["PEELER"], "rays", scene, "-o", out, "--quiet", "--engine", "cpu", "--columns",
                        "t_hit,primitive_ids,base_color", *options(camera)], check=True)
        hits = np.load(out)
        np.testing.assert_array_equal(hits["ray_splits"], captured.splits)
        np.testing.assert_array_equal(hits["primitive_ids"], captured.splat)
        pixels = np.stack([captured.pixel % width, captured.pixel // width], -1) + 0.5
        slopes = (pixels - camera.middle) / camera.focal
        apart = far_apart(hits["t_hit"], captured.z * np.sqrt((slopes**2).sum(-1) + 1))
        self.assertLess(apart, CLOSE)
        color = np.column_stack([captured.color / captured.alpha[:, None], captured.alpha])
        self.assertLess(far_apart(hits["base_color"], color), CLOSE)

    def test_methods_find_the_same_bytes(self):
        scene, camera = self.folder / "cloud.ply", CAMERAS["perspective"]
        write_ply(scene, random_cloud(self.random, 60, 2))
        for order in ("center", "ray"):
            words = ["--splat-order", order, "--method"]
            whole = Captured(scene, camera, self.folder, *words, "a-buffer")
            composite = self.composite(scene, camera, *words, "a-buffer").tobytes()
            self.assertGreater(len(whole.pixel), 1000)
            for method in METHODS if ALL or order == "ray" else METHODS[:1]:
                other = Captured(scene, camera, self.folder, *words, method)
                self.assertEqual(self.composite(scene, camera, *words, method).tobytes(), composite)
                for name, values in vars(whole).items():
                    self.assertEqual(values.tobytes(), vars(other)[name].tobytes(), f"{method}, {order}: {name}")

    def test_turned_with_the_camera(self):
        """A node and a camera that move together show the same; a node's size counts, too."""
        camera, cloud = CAMERAS["perspective"], random_cloud(self.random, 150, 3)
        write_gltf(self.folder / "still.glb", cloud)
        turn = np.eye(4)
        turn[:3, :3] = 2 * reference.rotations(np.array([[0.3, -0.7, 0.5, 0.4]]))[0]
        turn[:3, 3] = 3, -2, 5
        write_gltf(self.folder / "turned.glb", cloud, turn)
        pose = np.vstack([camera.pose, [0, 0, 0, 1]]) @ np.linalg.inv(turn)
        pose = 2 * pose[:3]  # lengths of the world
        for order in ("center", "ray"):
            still = Captured(self.folder / "still.glb", camera, self.folder, "--splat-order", order)
            turned = Captured(self.folder / "turned.glb", camera._replace(pose=pose, near=2 * camera.near), self.folder,
                              "--splat-order", order)
            self.assertGreater(len(still.pixel), 1000)
            ours, theirs = matched(self, still, turned)
            apart = [far_apart(getattr(turned, name)[theirs] / scale, getattr(still, name)[ours])
                     for name, scale in (("z", 2), ("alpha", 1), ("color", 1))]
            print("turned, {}: {:.1e} (Z), {:.1e} (alpha), {:.1e} (colour)".format(order, *apart))
            self.assertLess(max(apart), CLOSE)

    def test_gltf(self):
        """Splats of a glTF are not dilated, and sorted by distance; nodes turn and stretch them."""
        scene = self.folder / "cloud.glb"
        node = np.eye(4)
        node[:3, :3] = reference.rotations(np.array([[0.3, -0.7, 0.5, 0.4]]))[0] * [1.5, 0.8, 0.5]
        cloud = write_ply(self.folder / "cloud.ply", random_cloud(self.random, 150, 2))._replace(node=node)
        write_gltf(scene, cloud, node)
        for name, option, order in (("perspective", "center", "distance"), ("perspective", "ray", "ray"),
                                    ("parallel", "ray", "ray")):
            camera = CAMERAS[name]
            captured = Captured(scene, camera, self.folder, "--splat-order", option)
            apart, _ = compare(self, captured, cloud, camera, 0, order)
            print("glTF by {}: {:.1e} (Z), {:.1e} (alpha), {:.1e} (colour)".format(order, *apart))


if __name__ == "__main__":
    unittest.main()
