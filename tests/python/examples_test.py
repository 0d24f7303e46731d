# SPDX-License-Identifier: Apache-2.0
"""Tests that the examples of examples/python run, and that their pictures are not empty."""

import os
import subprocess
import sys
import unittest

from module import BUILD, SOURCE, ModuleTest, np, peeler, scene
from PIL import Image


class Examples(ModuleTest):
    def run_example(self, name, *arguments):
        done = subprocess.run(
            [sys.executable, "-B", SOURCE / "examples" / "python" / name, *arguments],
            env=os.environ | {"PYTHONPATH": str(BUILD / "python")},
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_peel_writes_an_animated_png(self):
        file = self.folder / "peeling.png"
        done = self.run_example("peel.py", SOURCE / "examples" / "scenes" / "panes.glb", file, "96x54")
        with peeler.Renderer() as r:
            layers = r.layers(scene("panes"), size=(96, 54), samples=4).layers
        self.assertIn(f"{2 * layers - 1} frames, {layers} layers", done.stdout)
        with Image.open(file) as picture:
            self.assertEqual((picture.size, picture.n_frames), ((96, 54), 2 * layers - 1))
            frames = []
            for number in range(picture.n_frames):
                picture.seek(number)
                frames.append(np.asarray(picture.convert("RGB")).astype(int))
        # Pixels without layers have the paper's colour: 0.82 in linear light, which is 234 in sRGB.
        paper = [(np.abs(frame - 234).max(axis=2) <= 1).sum() for frame in frames]
        self.assertEqual(paper, sorted(paper))
        self.assertLess(paper[0], paper[-1])

    def test_the_tour_ends_in_pictures(self):
        done = self.run_example("tour.py", self.folder)
        self.assertIn("did you mean 'main'?", done.stdout)
        self.assertTrue(done.stdout.endswith("good\n"), done.stdout)
        pictures = sorted(p.name for p in self.folder.glob("*.png"))
        self.assertEqual([int(name.split("_")[0]) for name in pictures], [1, 2, 4, 5, 6, 7, 8])
        for name in pictures:
            image = peeler.compare(self.folder / name, self.folder / name)
            self.assertTrue(image["identical"], name)
            self.assertGreater((self.folder / name).stat().st_size, 10_000, name)


if __name__ == "__main__":
    unittest.main()
