# SPDX-License-Identifier: Apache-2.0
"""Tests the package for a machine with a GPU (tests/gpu): its table of scenes, its reader of fragments and its
verdicts. With PEELER_TEST_ALL, packs it and runs it in a fresh root that debootstrap makes in memory, with only the C
library and Mesa's EGL (which takes minutes)."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import debian
import dockerfile
import own_machine
from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main, peeler

ALL = bool(os.environ.get("PEELER_TEST_ALL"))
NEEDED = 4e9  # the memory needed, in bytes
LARGEST = 60_000_000  # the maximum size of the archive, in bytes
GPU = SOURCE / "tests" / "gpu"
BUILD = pathlib.Path(shutil.which(PEELER) or PEELER).resolve().parent
MODELS = 8  # the number of models from the asset folder

# Three fragments in two pixels: pixel, Z, R, G, B, A (as bits), node, instance, triangle.
FRAGMENTS = ((3, 1000, 50, 51, 52, 53, 1, 0, 7), (3, 2000, 60, 61, 62, 63, 1, 0, 8), (5, 3000, 1, 2, 3, 4, 2, 0, 0))
# The same fragments in nine moved pictures: pixel, node, instance, triangle, number of pictures, minimum and maximum Z.
MOVED = "3 1 0 7 9 990 1010\n3 1 0 8 4 2000 2000\n4 1 0 8 5 2000 2000\n5 2 0 0 9 3000 3000\n"
HALF = 14336  # 0.5 as a half float


def changed(column, by, row=0):
    rows = [list(fragment) for fragment in FRAGMENTS]
    rows[row][column] += by
    return rows


# Each row: the fragments to compare; the numbers of fragments that are equal, differ in depth, differ in colour, lie at
# edges, and exceed all limits; whether the comparison passes.
VERDICTS = (
    (FRAGMENTS, (3, 0, 0, 0, 0), True),
    (FRAGMENTS[::-1], (3, 0, 0, 0, 0), True),
    (changed(1, 2), (3, 0, 0, 0, 0), True),
    (changed(1, 22), (2, 1, 0, 0, 0), True),
    (changed(1, -22), (2, 1, 0, 0, 0), True),
    (changed(1, 23), (2, 0, 0, 0, 1), False),
    (changed(1, 3, row=2), (2, 0, 0, 0, 1), False),
    (changed(5, -1), (2, 0, 1, 0, 0), True),
    (changed(2, HALF), (2, 0, 0, 0, 1), False),
    (changed(2, HALF, row=1), (2, 0, 0, 1, 0), True),
    (FRAGMENTS[::2], (2, 0, 0, 1, 0), True),
    (FRAGMENTS[1:], (2, 0, 0, 0, 1), False),
    (changed(0, 1, row=1), (2, 0, 0, 2, 0), True),
    (changed(8, 1, row=2), (2, 0, 0, 0, 2), False),
)
CLASSES = re.compile("(.*) the same, (.*) other depth, (.*) other colour, (.*) at edges, (.*) beyond, colours differ by ")


def text_of(rows):
    return "".join(" ".join(map(str, row)) + "\n" for row in rows)


class Parts(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.scratch = pathlib.Path(scratch.name)

    def test_scripts_are_shell(self):
        for script in GPU.glob("*.sh"):
            subprocess.run(["sh", "-n", script], check=True)

    def test_table_has_every_example_and_eight_models(self):
        lines = (GPU / "scenes.txt").read_text().splitlines()
        rows = [line.split() for line in lines if line and not line.startswith("#")]
        self.assertEqual(len({row[0] for row in rows}), len(rows))
        files = [row[1] for row in rows]
        examples = sorted(file.name for file in (EXAMPLES / "scenes").glob("*.glb"))
        self.assertEqual(sorted(file for file in files if "/" not in file), examples)
        models = [file for file in files if "/" in file]
        self.assertEqual(len(models), MODELS)
        assets = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")
        if assets.is_dir():
            self.assertEqual([file for file in models if not (assets / file).is_file()], [])

    def test_fragments_are_those_of_the_file(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("no numpy")
        arrays = self.scratch / "arrays.npz"
        scene = EXAMPLES / "scenes" / "coincident.glb"
        done = peeler("render", scene, "-o", arrays, "--size", "48x27", "--channels", "id", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = subprocess.run(
            ["sh", "-euc", f'here=/nowhere; . "{GPU}/common.sh"; fragments "$1"', "sh", arrays],
            text=True, capture_output=True, check=True,
        ).stdout
        held = numpy.load(arrays)
        pixels = numpy.repeat(numpy.arange(48 * 27), numpy.diff(held["ray_splits"]))
        columns = (pixels, held["z"].view("u4"), *held["rgba"].view("u2").T,
                   *(held[name + "_ids"] for name in ("node", "instance", "primitive")))
        self.assertGreater(len(pixels), 100)
        self.assertEqual(found, text_of(zip(*columns)))

    def test_differences_are_judged_by_class(self):
        (self.scratch / "moved").write_text(MOVED)
        (self.scratch / "expected").write_text(text_of(FRAGMENTS))
        for rows, told, passes in VERDICTS:
            (self.scratch / "found").write_text(text_of(rows))
            done = subprocess.run(
                ["awk", "-f", GPU / "classify.awk", "moved", "expected", "found"],
                text=True, capture_output=True, check=False, cwd=self.scratch,
            )
            classes = tuple(map(int, CLASSES.match(done.stdout).groups()))
            self.assertEqual((classes, done.returncode == 0), (told, passes), rows)

    def test_one_fragment_in_50_may_be_beyond(self):
        many = [(pixel, 1000, 50, 51, 52, 53, 1, 0, 7) for pixel in range(100)]
        (self.scratch / "moved").write_text("".join(f"{pixel} 1 0 7 9 1000 1000\n" for pixel in range(100)))
        (self.scratch / "expected").write_text(text_of(many))
        for beyond, passes in ((2, True), (3, False)):
            (self.scratch / "found").write_text(text_of([(p, 2000, *more) if p < beyond else (p, z, *more) for p, z, *more in many]))
            done = subprocess.run(["awk", "-f", GPU / "classify.awk", "moved", "expected", "found"], cwd=self.scratch, check=False,
                                  stdout=subprocess.DEVNULL)
            self.assertEqual(done.returncode == 0, passes)

    def test_moved_pictures_are_put_together(self):
        pictures = FRAGMENTS + (tuple(changed(1, 5)[0]),) + (tuple(changed(1, -7)[0]),)
        told = subprocess.run(["awk", "-f", GPU / "moved.awk"], input=text_of(pictures), text=True, capture_output=True, check=True)
        self.assertEqual(sorted(told.stdout.splitlines()),
                         ["3 1 0 7 3 993 1005", "3 1 0 8 1 2000 2000", "5 2 0 0 1 3000 3000"])


@unittest.skipUnless(ALL, "packed and carried out only with PEELER_TEST_ALL: debootstrap, apt, minutes")
class BareMachine(PeelerTest):
    def test_run(self):
        started = time.monotonic()
        scratch = own_machine.SCRATCH
        own_machine.mount("none", scratch, "tmpfs", data=f"size={int(NEEDED)}")
        debian.make_root(debian.suite(), f"{scratch}/base")
        root = dockerfile.Stage(f"{scratch}/base", f"{scratch}/root")
        root.variables |= {"LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        if "PEELER_GPU_SECONDS" in os.environ:  # a longer limit, for a busy machine
            root.variables["PEELER_GPU_SECONDS"] = os.environ["PEELER_GPU_SECONDS"]
        install = "apt-get update -qq && apt-get install -y -qq --no-install-recommends libegl1 libgl1-mesa-dri"
        done = root.run(["sh", "-c", install])
        self.assertEqual(done.returncode, 0, done.stdout[-3000:])
        archive = pathlib.Path(root.root, "peeler-gpu.tar.gz")
        subprocess.run(["sh", GPU / "pack.sh", BUILD, archive], check=True)
        self.assertLessEqual(archive.stat().st_size, LARGEST)
        print(f"{time.monotonic() - started:6.1f} s  a root, and the archive", flush=True)
        done = root.run(["sh", "-c", "tar -xzf /peeler-gpu.tar.gz -C /opt && sh /opt/peeler-gpu/run.sh"])
        print(f"{time.monotonic() - started:6.1f} s\n{done.stdout}", flush=True)
        page = pathlib.Path(root.root, "opt/peeler-gpu/results").with_suffix(".md")
        print(page.read_text(), flush=True)
        self.assertEqual(done.returncode, 0)


if __name__ == "__main__":
    if not ALL:
        sys.exit(main())
    debian.in_own_machine("gpu", main, debian.suite(), NEEDED)
