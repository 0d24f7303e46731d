# SPDX-License-Identifier: Apache-2.0
"""Tests examples/gnu-parallel/frames.sh: run, stopped and resumed."""

import csv
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from peeler_command import EXAMPLES, PEELER, PeelerTest, animated_scene, fingerprints, main, skip


FRAMES = ("--frames", "0-17", "--size", "160x120")


class GnuParallel(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.frames = self.folder / "it's the folder"  # a name that an unquoted shell word would split

    def run_script(self, *arguments, **environment):
        """Runs 6 chunks, 2 at a time: of 18 frames, or with other arguments. Returns the finished process, and {chunk:
        its exit codes in the job log}."""
        script = EXAMPLES / "gnu-parallel" / "frames.sh"
        arguments = arguments or (animated_scene(), "-o", self.frames / "walk.####.exr", *FRAMES)
        command = ["sh", script, 6, 2, *arguments, "--quiet"]
        home = str(self.folder)
        done = subprocess.run(
            [str(word) for word in command],
            cwd=self.folder,
            text=True,
            capture_output=True,
            check=False,
            env={
                **os.environ,
                "PEELER": PEELER,
                "HOME": home,
                "PARALLEL_HOME": home,
                **environment,
            },
        )
        with open(self.folder / "peeler.joblog", newline="", encoding="utf-8") as log:
            codes = {}
            for row in csv.DictReader(log, delimiter="\t", quoting=csv.QUOTE_NONE):
                codes.setdefault(int(row["Seq"]), []).append(int(row["Exitval"]))
        return done, codes

    def test_resume(self):
        # A file has the output folder's name, so every chunk fails. After the first failure, no further chunk starts.
        self.frames.write_text("")
        done, codes = self.run_script()
        self.assertNotEqual(done.returncode, 0)
        self.assertLess(len(codes), 6, codes)
        self.assertEqual({code for chunk in codes.values() for code in chunk}, {4}, done.stderr)

        self.frames.unlink()
        done, codes = self.run_script(PEELER_HOSTS="2/:")  # ":" is this machine, without ssh
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([chunk[-1] for chunk in codes.values()], [0] * 6)
        self.assertEqual(len(codes[1]), 2, "the chunk that had failed ran again")
        self.verify(self.frames, 18)
        self.assert_nothing_else(self.frames, 18)
        (self.folder / "whole").mkdir()
        self.render(animated_scene(), "-o", self.folder / "whole" / "walk.####.exr", *FRAMES)
        self.assertEqual(fingerprints(self.frames), fingerprints(self.folder / "whole"))

        # All frames exist, so no command runs.
        before = (self.folder / "peeler.joblog").read_bytes()
        done, _ = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / "peeler.joblog").read_bytes(), before)

        (self.folder / "peeler.joblog").unlink()
        done, _ = self.run_script("flatten", self.frames / "walk.####.exr", "-o", self.frames / "flat.####.png")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(list(self.frames.glob("flat.*.png"))), 18)


if __name__ == "__main__":
    if not shutil.which("parallel"):
        skip("no parallel (examples/install_dependencies.sh test)")
    sys.exit(main())
