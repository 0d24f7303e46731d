# SPDX-License-Identifier: Apache-2.0
"""The benchmarks' scripts still run, and tests/benchmarks/RESULTS.md and README.md agree.

Small pictures, once; what is measured is not looked at. What needs programs of the benchmarks' own
(side by side, baking) is not run here."""

import subprocess
import sys
import unittest

from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main

BENCHMARKS = SOURCE / "tests" / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
import results  # noqa: E402

SCENE = EXAMPLES / "scenes" / "coincident.glb"
REFEREE_RUNS = not subprocess.run(
    ["/usr/bin/python3", "-c", "import numpy, OpenImageIO"], capture_output=True, check=False
).returncode


class Benchmarks(PeelerTest):
    def rows(self, script, *arguments):
        """Of the table that it prints."""
        done = subprocess.run(
            ["/usr/bin/python3", "-B", str(BENCHMARKS / script), PEELER, *map(str, arguments)],
            text=True,
            capture_output=True,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return list(results.rows(done.stdout))

    def test_stage_times(self):
        methods = ("--methods", "a-buffer,two-pass")
        rows = self.rows("stage_times.py", SCENE, "--size", "64x36", "--runs", 1, *methods)
        self.assertEqual([row["method"] for row in rows], ["a-buffer", "two-pass"])
        self.assertEqual([row["layers"] for row in rows], ["6", "6"])

    def test_file_sizes(self):
        rows = self.rows("file_sizes.py", SCENE, "--size", "32x18", "--runs", 1)
        self.assertEqual(len(rows), 15)
        self.assertEqual({"", "coincident"}, rows[0].keys())

    def test_views_from_layers(self):
        rows = self.rows("views_from_layers.py", SCENE, "--size", "64x36", "--angles", 10)
        self.assertEqual([row["beside it"] for row in rows], ["0°", "10°"])
        self.assertEqual(rows[0]["all layers, dB"], "inf")

    def test_frames_in_one_process(self):
        render = ("--", "--size", "32x18")
        rows = self.rows("frames_in_one_process.py", SCENE, "--frames", 2, "--runs", 1, *render)
        self.assertEqual([row["frames"] for row in rows], ["2"])

    @unittest.skipUnless(REFEREE_RUNS, "Debian's python3-numpy or python3-openimageio is missing")
    def test_referee(self):
        tiny = ("--size", 12, "--samples", 256, "--height", 32, "--edge", 70)
        rows = self.rows("referee.py", *tiny, "--only", "white")
        self.assertEqual(rows[0]["sphere"], "white diffuse")
        self.assertEqual(len(rows), 9)
        for row in rows:
            self.assertAlmostEqual(float(row["mean, ours to the referee's"]), 1, delta=0.05, msg=row)
            self.assertLess(float(row["relative error"]), 0.2, row)
        other = self.rows("referee.py", *tiny, "--only", "white diffuse", "--environment-rotation=90")
        self.assertGreater(float(other[0]["relative error"]), 0.2)

    def test_budgets(self):
        rows = self.rows("budgets.py", "--quick")
        self.assertEqual([row["--memory"] for row in rows], ["400M"])


class Results(PeelerTest):
    TEXT = results.RESULTS.read_text(encoding="utf-8")

    def test_sections(self):
        sections = results.split(self.TEXT)
        self.assertEqual(list(sections), list(results.SECTIONS))
        self.assertEqual(results.joined(sections), self.TEXT)
        for name, text in sections.items():
            for fact in ("commit", "machine", "renderer"):
                self.assertIn(f"\n- {fact}: ", text, name)
            self.assertGreater(len(list(results.rows(text))), 0, name)

    def test_a_section_takes_its_place(self):
        known = {"commit": "abc", "machine": "fast", "renderer": "good"}
        new = results.written("views", known, "`a command`\n\n| scene |\n| --- |\n| new |\n")
        sections = results.split(results.joined({**results.split(self.TEXT), "views": new}))
        self.assertEqual(list(sections), list(results.SECTIONS))
        self.assertEqual(sections["views"], new)
        self.assertEqual([row["scene"] for row in results.rows(sections["views"])], ["new"])

    def test_numbers(self):
        """Another result is another table, and one without a row of it is an error."""
        readme = (SOURCE / "README.md").read_text(encoding="utf-8")
        self.assertEqual(results.with_numbers(readme, self.TEXT), readme)
        row = "| capture | spheres | 1920x1080 | "
        other = self.TEXT.replace(row, row + "9")
        self.assertNotEqual(results.with_numbers(readme, other), readme)
        gone = self.TEXT.replace("| capture | spheres |", "| capture | cubes |")
        self.assertRaises(LookupError, results.with_numbers, readme, gone)


if __name__ == "__main__":
    sys.exit(main())
