# SPDX-License-Identifier: Apache-2.0
"""The tour of examples/python runs, and its pictures are not empty."""

import os
import subprocess
import sys
import unittest

from module import BUILD, SOURCE, ModuleTest, peeler


class Tour(ModuleTest):
    def test_it_ends_in_pictures(self):
        done = subprocess.run(
            [sys.executable, "-B", SOURCE / "examples" / "python" / "tour.py", self.folder],
            env=os.environ | {"PYTHONPATH": str(BUILD / "python")},
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
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
