# SPDX-License-Identifier: Apache-2.0
"""Tests examples/openjd/peeler.yaml by running every command line of its expansion."""

import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from peeler_command import EXAMPLES, PEELER, PeelerTest, animated_scene, fingerprints, main, skip

if importlib.util.find_spec("yaml") is None:
    skip("Python has no module yaml (examples/install_dependencies.sh test)")
import openjd_template

TEMPLATE = str(EXAMPLES / "openjd" / "peeler.yaml")


class Expansion(PeelerTest):
    """Tests the expansion itself against the specification and its conformance tests."""

    def test_ranges(self):
        for expression, values in (  # [3.4.1.1.1], the table of examples
            ("1 - 5", [1, 2, 3, 4, 5]),
            ("1 - -1", [1]),
            ("-1 - 1", [-1, 0, 1]),
            ("1-5:2", [1, 3, 5]),
            ("10-15:2,1-5", [1, 2, 3, 4, 5, 10, 12, 14]),
            ("1-10:4", [1, 5, 9]),
        ):
            self.assertEqual(openjd_template.integers(expression), values)
        with self.assertRaises(openjd_template.Invalid):
            openjd_template.integers("1-10:4,10-15")

    def test_chunks(self):
        for expression, size, chunks in (
            ("1-8", 3, ["1-3", "4-6", "7,8"]),  # noncontiguous-format.test.yaml
            ("1-12", 5, ["1-4", "5-8", "9-12"]),  # chunk-3.4.1.5--contiguous-uneven.test.yaml
            ("1-3", 10, ["1-3"]),
            ("1-5,7,9-21:2", 20, ["1-5,7-21:2"]),
            ("-3--1,4,9", 10, ["-3--1,4,9"]),
        ):
            values = openjd_template.chunked(openjd_template.integers(expression), size)
            self.assertEqual([openjd_template.range_expression(chunk) for chunk in values], chunks)


class OpenJD(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.lines = []

    def run_job(self, **values):
        """Runs the steps in order, and returns their exit codes."""
        job = openjd_template.Job(TEMPLATE, {"Peeler": PEELER, **values}, str(self.folder))
        codes = []
        for step in job.steps:
            for number, task in enumerate(job.tasks(step)):
                session = self.folder / f"{step['name']} {number} {len(self.lines)}"
                session.mkdir()
                command = job.command(step, task, str(session))
                done = subprocess.run(
                    command,
                    cwd=session,
                    text=True,
                    check=False,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                )
                codes.append(done.returncode)
                self.lines.append((" ".join(command), done.stdout))
        return codes

    def test_job(self):
        scene = animated_scene()
        (self.folder / "the frames").mkdir()  # a name that an unquoted shell word would split
        values = {
            "Scene": str(scene),
            "OutputFolder": "the frames",
            "Name": "a walk",
            "Frames": "-2-26:2",
            "FramesPerChunk": "4",
            "Options": "--size 160x120",
        }
        numbers = range(-2, 27, 2)
        self.assertEqual(self.run_job(**values), [0] * 5, self.lines)
        for command, _ in self.lines:
            print(command)
        self.verify(self.folder / "the frames", len(numbers))
        self.assert_nothing_else(self.folder / "the frames", len(numbers))

        (self.folder / "whole").mkdir()
        self.render(
            scene,
            "-o",
            self.folder / "whole" / "a walk.####.exr",
            "--size",
            "160x120",
            f"--frames={','.join(map(str, numbers))}",
        )
        self.assertEqual(
            fingerprints(self.folder / "the frames"), fingerprints(self.folder / "whole")
        )

        # Format of progress messages: "How Jobs Are Run", section "Stdout/Stderr Messages".
        for _, text in self.lines[:-1]:
            progress = [
                float(n) for n in re.findall(r"^openjd_progress: (\d+(?:\.\d+)?)$", text, re.M)
            ]
            self.assertTrue(progress, text)
            self.assertEqual(progress, sorted(progress))
            self.assertLessEqual(progress[-1], 100)
            self.assertIsNone(re.search(r"^openjd_fail:", text, re.M))

        # A second run finds all files.
        before = {
            file: os.stat(file).st_mtime_ns for file in (self.folder / "the frames").iterdir()
        }
        self.assertEqual(self.run_job(**values), [0] * 5, self.lines)
        after = {file: os.stat(file).st_mtime_ns for file in (self.folder / "the frames").iterdir()}
        self.assertEqual(after, before)

    def test_other_verbs_and_views(self):
        views = {"Scene": str(animated_scene()), "OutputFolder": "files", "Name": "walk.@@", "Frames": "1-2"}
        (self.folder / "files").mkdir()
        self.assertEqual(self.run_job(**views, Options="--size 32x24 --views 2"), [0] * 2, self.lines)
        flat = {"Verb": "flatten", "Extension": "png", "FramesPerChunk": "1", "Options": ""}
        views["Scene"] = str(self.folder / "files" / "walk.@@.####.exr")
        self.assertEqual(self.run_job(**{**views, **flat}), [0] * 3, self.lines)
        names = sorted(file.name for file in (self.folder / "files").glob("*.png"))
        self.assertEqual(names, [f"walk.{view:02}.{frame:04}.png" for view in (0, 1) for frame in (1, 2)])

    def test_failure(self):
        self.assertEqual(
            self.run_job(Scene="missing.glb", OutputFolder=".", Frames="1"), [3, 3], self.lines
        )
        self.assertRegex(self.lines[0][1], r"(?m)^openjd_fail: .*missing\.glb")


if __name__ == "__main__":
    sys.exit(main())
