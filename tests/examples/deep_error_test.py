# SPDX-License-Identifier: Apache-2.0
"""Tests --deep-error with an independent witness: OpenImageIO reads both files, and numpy walks every pixel's samples at
every depth. PEELER_TEST_ALL takes more scenes."""

import json
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import numpy as np
from peeler_command import EXAMPLES, SOURCE, PeelerTest, main, peeler, skip

try:
    import OpenImageIO as oiio
except ImportError:
    skip("Debian's python3-openimageio is missing")

EVERYTHING = bool(os.environ.get("PEELER_TEST_ALL"))
ERRORS = (1 / 4096, 1 / 1024, 1 / 256)
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")
SCENES = sorted((EXAMPLES / "scenes").glob("*.glb")) if EVERYTHING else [EXAMPLES / "scenes" / "glasses.glb"]
MODELS = ("AlphaBlendModeTest", "DamagedHelmet", "GlassVaseFlowers", "StainedGlassLamp", "TransmissionTest")
ROUNDING = 1e-9  # of the witness's double precision


def models():
    """Returns the first file of each model."""
    folder = ASSETS / "gltf-sample-assets"
    if not folder.is_dir():
        print(f"left out: {len(MODELS)} models; no asset folder (set PEELER_ASSETS)")
        return []
    return [sorted((folder / name).rglob("*.gl*"))[0] for name in MODELS]


class Deep:
    """The samples of a deep file: depths and colours of all pixels, `begin` the first sample of each pixel."""

    def __init__(self, path):
        file = oiio.ImageInput.open(str(path))
        spec = file.spec()
        self.window = (spec.x, spec.y, spec.width, spec.height)
        data = file.read_native_deep_image()
        names = [name.split(".")[-1] for name in spec.channelnames]
        counts = [data.samples(p) for p in range(spec.width * spec.height)]
        self.begin = np.concatenate([[0], np.cumsum(counts)])

        def channel(name):
            c, value = names.index(name), data.deep_value
            return np.array([value(p, c, s) for p, n in enumerate(counts) for s in range(n)], float)

        self.z = channel("Z")
        self.back = np.maximum(channel("ZBack"), self.z) if "ZBack" in names else self.z
        self.tinted = "AR" in names
        self.color = np.stack([channel(c) for c in "RGB"], -1) if "R" in names else np.zeros((len(self.z), 3))
        if self.tinted:
            self.alpha = np.stack([channel(c) for c in ("AR", "AG", "AB")], -1)
        else:
            self.alpha = np.repeat(channel("A")[:, None], 3, 1) if "A" in names else np.ones((len(self.z), 3))

    def pixel(self, x, y):
        """Returns (z, back, color, alpha) of a pixel's samples, nearest first."""
        left, top, width, height = self.window
        if not (left <= x < left + width and top <= y < top + height):
            return self.z[:0], self.back[:0], self.color[:0], self.alpha[:0]
        p = (y - top) * width + x - left
        order = self.begin[p] + np.argsort(self.z[self.begin[p] : self.begin[p + 1]], kind="stable")
        return self.z[order], self.back[order], self.color[order], self.alpha[order]


def states(samples, depths):
    """Returns accumulated colour and transmittance just in front of, and just behind, each depth: (2, depths, 6).
    OpenEXR's "Interpreting OpenEXR Deep Pixels": a volume absorbs and emits at constant rates from Z to ZBack."""
    z, back, color, alpha = samples
    points = back <= z
    out = np.empty((2, len(depths), 6))
    if points.all():
        before = np.cumprod(np.concatenate([np.ones((1, 3)), 1 - alpha]), 0)
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(before[:-1] * color, 0)])
        for side, name in enumerate(("left", "right")):
            at = np.searchsorted(z, depths, name)
            out[side] = np.concatenate([sums[at], before[at]], -1)
        return out
    opaque = alpha >= 1
    length = np.where(points, 1, back - z)[:, None]
    rate = np.where(opaque, 0, -np.log1p(-np.where(opaque, 0, alpha))) / length
    source = np.where(alpha > 0, color * rate / np.where(alpha > 0, alpha, 1), color / length)
    here = np.concatenate([np.zeros(3), np.ones(3)])
    last = depths[0]
    for i, depth in enumerate(depths):
        inside = ~points & (z <= last) & (back >= depth)
        step, emitted = (depth - last) * np.where(inside[:, None] & ~opaque, rate, 0).sum(0), np.where(
            inside[:, None] & ~opaque, source, 0
        ).sum(0)
        share = np.where(step > 0, -np.expm1(-step) / np.where(step > 0, step, 1), 1)
        here[:3] += here[3:] * emitted * share * (depth - last)
        here[3:] *= np.exp(-step)
        out[0, i] = here
        # Points, and the opaque channels of volumes, take effect at their front.
        for s in np.flatnonzero(z == depth):
            now = opaque[s] | points[s]
            here[:3] += np.where(now, here[3:] * color[s], 0)
            here[3:] *= np.where(now, 1 - alpha[s], 1)
        out[1, i] = here
        last = depth
    return out


def difference(a, b):
    """Returns the largest difference of a pixel's samples `a` from the original `b`, and the scale of its colours."""
    ends = np.unique(np.concatenate([a[0], a[1], b[0], b[1]]))
    if not len(ends):
        return 0.0, 1.0
    if (a[1] > a[0]).any() or (b[1] > b[0]).any():
        inside = [ends[:-1] + (ends[1:] - ends[:-1]) * share for share in (0.2, 0.4, 0.6, 0.8)]
        ends = np.unique(np.concatenate([ends, *inside]))
    mine, original = states(a, ends), states(b, ends)
    scale = max(1.0, np.abs(original[..., :3]).max())
    error = np.abs(mine - original)
    error[..., :3] /= scale
    return error.max(), scale


def pixels(deep):
    left, top, width, height = deep.window
    counts = np.diff(deep.begin)
    for p in np.flatnonzero(counts):
        yield left + int(p) % width, top + int(p) // width


def flat(samples, matte):
    """Returns colour and opacity of point samples, each weakened by the matte's transmittance at its depth."""
    z, _, color, alpha = samples
    before = np.cumprod(np.concatenate([np.ones((1, 3)), 1 - alpha]), 0)[:-1]
    weight = before * matte(z)[:, None]
    return np.concatenate([(weight * color).sum(0), (weight * alpha).sum(0)])


class DeepError(PeelerTest):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    def run_peeler(self, *arguments):
        done = peeler(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def check(self, original_path, error, *options):
        """Thins a file, and returns the original and the thinned samples, which the witness has compared."""
        path = self.folder / "thin.exr"
        self.run_peeler("convert", original_path, "-o", path, "--as", "deep", "--deep-error", f"{error:.12g}", *options, "-q")
        original, thin = Deep(original_path), Deep(path)
        worst = max((difference(thin.pixel(x, y), original.pixel(x, y))[0] for x, y in pixels(original)), default=0)
        self.assertLessEqual(worst, error + ROUNDING, f"{original_path} {error}")
        found = json.loads(self.run_peeler("verify", path, "--against", original_path, "--any-settings", "--json"))
        against = found["files"][0]["against"]
        self.assertTrue(against["isOriginal"])
        self.assertEqual(against["samples"], len(thin.z))
        self.assertEqual(against["originalSamples"], len(original.z))
        # The witness samples volumes at some depths only, so peeler may find more.
        volumes = (original.back > original.z).any()
        self.assertLessEqual(worst, against["difference"] + ROUNDING)
        self.assertLessEqual(against["difference"], worst + (error / 20 if volumes else ROUNDING))
        return original, thin

    def test_scenes(self):
        for scene in SCENES + (models() if EVERYTHING else []):
            source = self.folder / "source.exr"
            self.render(scene, "-o", source, "--as", "deep", "--size", "64x36", "--samples", "4")
            for error in ERRORS if EVERYTHING else ERRORS[1:2]:
                with self.subTest(scene=scene.name, error=error):
                    original, thin = self.check(source, error)
                    self.assertLess(len(thin.z), len(original.z) + 1)

    def test_holdouts_and_merges(self):
        """200 random mattes and elements change by at most the bound that examples/guide/compositing.md states."""
        source = self.folder / "source.exr"
        self.render(EXAMPLES / "scenes" / "glasses.glb", "-o", source, "--as", "deep", "--size", "48x27", "--samples", "4", "--precision", "float")
        error = 1 / 256
        original, thin = self.check(source, error)
        random = np.random.default_rng(47)
        places = [p for p in pixels(original) if len(original.pixel(*p)[0]) > 1]
        depths = np.quantile(original.z, [0, 1]) + [-0.1, 0.1]
        largest = [0.0, 0.0]
        for _ in range(200):
            count = random.integers(1, 12)
            matte_z, alpha = np.sort(random.uniform(*depths, count)), random.random(count)
            color = random.random((count, 3)) * alpha[:, None] * 3
            through = np.concatenate([[1], np.cumprod(1 - alpha)])
            matte = lambda z: through[np.searchsorted(matte_z, z)]
            other = (matte_z, matte_z, color, np.repeat(alpha[:, None], 3, 1))
            total = flat(other, np.ones_like)[:3].max()
            for place in [places[i] for i in random.integers(0, len(places), 20)]:
                mine, whole = thin.pixel(*place), original.pixel(*place)
                scale = difference(mine, whole)[1]
                held = np.abs(flat(mine, matte) - flat(whole, matte))
                largest[0] = max(largest[0], held[:3].max() / scale, held[3:].max())
                merged = []
                for samples in (mine, whole):
                    both = [np.concatenate([a, b]) for a, b in zip(samples, other)]
                    order = np.argsort(both[0], kind="stable")
                    merged.append(flat([part[order] for part in both], np.ones_like))
                change = np.abs(merged[0] - merged[1])
                largest[1] = max(largest[1], change[:3].max() / (scale + total), change[3:].max())
        print("holdouts", largest[0] / error, "of the bound, merges", largest[1] / error)
        self.assertLessEqual(max(largest), error + ROUNDING)
        self.assertGreater(min(largest), error / 20)

    def write_volumes(self, path, tinted):
        """Writes volumes that overlap, points among them, with OpenImageIO."""
        random = np.random.default_rng(11)
        names = ["R", "G", "B", "A", "Z", "ZBack"] + (["AR", "AG", "AB"] if tinted else [])
        spec = oiio.ImageSpec(8, 4, len(names), oiio.FLOAT)
        spec.channelnames, spec.deep = names, True
        data = oiio.DeepData()
        data.init(32, len(names), oiio.FLOAT, names)
        for p in range(32):
            count = int(random.integers(0, 25))
            data.set_samples(p, count)
            for s in range(count):
                z = float(random.uniform(1, 10))
                back = z + float(random.choice([0, random.uniform(0, 4)]))
                tint = random.random(3) if tinted else np.ones(3)
                opacity = float(random.random() ** 3 * (1.0 if p % 5 else 0.05)) * tint
                if p % 7 == 0 and s == 0:
                    opacity = np.ones(3)
                color = opacity * random.random(3)
                values = [*color, opacity.mean(), z, back, *opacity]
                for c in range(len(names)):
                    data.set_deep_value(p, c, s, float(values[c]))
        out = oiio.ImageOutput.create(str(path))
        self.assertTrue(out.open(str(path), spec) and out.write_deep_image(data) and out.close(), out.geterror())

    def test_volumes_of_another_program(self):
        for tinted in (False, True):
            path = self.folder / "volumes.exr"
            self.write_volumes(path, tinted)
            for error in (1 / 1024, 1 / 64):
                original, thin = self.check(path, error)
            self.assertLess(len(thin.z), 0.6 * len(original.z))
            self.assertTrue((thin.back > thin.z).any())

    def test_files_of_other_programs(self):
        names = ["11.deep", "objectid.deep", "Trunks", "Balls"] if EVERYTHING else ["tinydeep"]
        for name in names:
            path = ASSETS / "exr-conformance" / f"{name}.exr"
            if path.is_file():
                with self.subTest(name=name):
                    self.check(path, 1 / 256)

    def test_a_worse_file_fails(self):
        """The certificate does not cover another file."""
        source, other, path = (self.folder / f"{name}.exr" for name in ("source", "other", "thin"))
        panes = EXAMPLES / "scenes" / "panes.glb"
        self.render(panes, "-o", source, "--as", "deep", "--size", "32x18")
        self.render(EXAMPLES / "scenes" / "coincident.glb", "-o", other, "--as", "deep", "--size", "32x18")
        self.run_peeler("convert", source, "-o", path, "--as", "deep", "--deep-error", "1/256", "-q")
        self.run_peeler("verify", path)
        done = peeler("verify", path, "--against", other)
        self.assertEqual(done.returncode, 3)
        self.assertIn("for another original", done.stdout)
        # The same samples as layers are the original, too.
        self.run_peeler("convert", source, "-o", other, "-q", "--as", "ldi")
        self.assertNotIn("another", self.run_peeler("verify", path, "--against", other))


if __name__ == "__main__":
    sys.exit(main())
