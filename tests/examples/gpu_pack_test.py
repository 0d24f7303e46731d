# SPDX-License-Identifier: Apache-2.0
"""What is carried to a machine with a GPU (tests/gpu): the table of scenes, how fragments are read and
differences judged there; with PEELER_TEST_ALL all of it, packed and carried out in a fresh root that
debootstrap makes in memory, with nothing but the C library and Mesa's EGL (minutes)."""

import os
import pathlib
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
NEEDED = 4e9  # bytes of memory
LARGEST = 60_000_000  # bytes of the archive
GPU = SOURCE / "tests" / "gpu"
BUILD = pathlib.Path(shutil.which(PEELER) or PEELER).resolve().parent
MODELS = 8  # of the asset folder

# Three fragments of two pixels: pixel, Z, R, G, B, A (bits), node, instance, triangle.
FRAGMENTS = ((3, 1000, 50, 51, 52, 53, 1, 0, 7), (3, 2000, 60, 61, 62, 63, 1, 0, 8), (5, 3000, 1, 2, 3, 4, 2, 0, 0))
EDGES = "3 1 0 8\n4 1 0 8\n"


def changed(column, by, row=0):
    rows = [list(fragment) for fragment in FRAGMENTS]
    rows[row][column] += by
    return rows


# What is found, what it differs in from FRAGMENTS, and whether that passes.
VERDICTS = (
    (FRAGMENTS, "3 the same, 0 other depth, 0 other colour, 0 other coverage, 0 beyond", True),
    (FRAGMENTS[::-1], "3 the same, 0 other depth, 0 other colour, 0 other coverage, 0 beyond", True),
    (changed(1, 2), "2 the same, 1 other depth, 0 other colour, 0 other coverage, 0 beyond", True),
    (changed(1, -3), "2 the same, 0 other depth, 0 other colour, 0 other coverage, 1 beyond", False),
    (changed(5, -1), "2 the same, 0 other depth, 1 other colour, 0 other coverage, 0 beyond", True),
    (changed(2, 2), "2 the same, 0 other depth, 0 other colour, 0 other coverage, 1 beyond", False),
    (FRAGMENTS[::2], "2 the same, 0 other depth, 0 other colour, 1 other coverage, 0 beyond", True),
    (FRAGMENTS[1:], "2 the same, 0 other depth, 0 other colour, 0 other coverage, 1 beyond", False),
    (changed(0, 1, row=1), "2 the same, 0 other depth, 0 other colour, 2 other coverage, 0 beyond", True),
    (changed(8, 1, row=2), "2 the same, 0 other depth, 0 other colour, 0 other coverage, 2 beyond", False),
)


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
        (self.scratch / "edges").write_text(EDGES)
        (self.scratch / "expected").write_text(text_of(FRAGMENTS))
        for rows, told, passes in VERDICTS:
            (self.scratch / "found").write_text(text_of(rows))
            done = subprocess.run(
                ["awk", "-f", GPU / "classify.awk", "edges", "expected", "found"],
                text=True, capture_output=True, check=False, cwd=self.scratch,
            )
            self.assertEqual((done.stdout.splitlines()[0], done.returncode == 0), (told, passes), rows)


@unittest.skipUnless(ALL, "packed and carried out only with PEELER_TEST_ALL: debootstrap, apt, minutes")
class BareMachine(PeelerTest):
    def test_run(self):
        started = time.monotonic()
        scratch = own_machine.SCRATCH
        own_machine.mount("none", scratch, "tmpfs", data=f"size={int(NEEDED)}")
        debian.make_root(debian.suite(), f"{scratch}/base")
        root = dockerfile.Stage(f"{scratch}/base", f"{scratch}/root")
        root.variables |= {"LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        if "PEELER_GPU_SECONDS" in os.environ:  # of a machine that has other work
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
