# SPDX-License-Identifier: Apache-2.0
"""Tests the race in Mesa's rasteriser that cmd/mutex_destroy.cpp fixes: a program crashes without the fix, but not with
it.

The rasteriser is stalled at the critical points, and each fence is allocated in pages of its own (support/driver_race).
With such stalls, renders must give the usual files. The number of renders is 4, with PEELER_TEST_ALL 160, or
PEELER_STALLED_RENDERS. ThreadSanitizer, which disables the fix (PEELER_SANITIZE), must report the race despite the
suppressions in sanitizers/races.txt.

FENCE_RACE is support/programs/fence_race.cpp, FENCE_RACE_MENDED the same program with the fix, DRIVER_RACE the
preloaded library, PEELER the program itself.
"""

import itertools
import os
import pathlib
import re
import resource
import subprocess
import tempfile
import unittest
from unittest import mock

SCENES = pathlib.Path(__file__).resolve().parents[1] / "examples" / "scenes"
RACES = pathlib.Path(__file__).resolve().parent / "sanitizers" / "races.txt"
ALL = "PEELER_TEST_ALL" in os.environ
SANITIZER = os.environ.get("PEELER_SANITIZE", "")
BACKENDS = ("egl", "osmesa")
FENCES = "112,120"  # the sizes of a fence in bytes, in Mesa 22.3 and 25.0
RUNS, STALLS = (40, 500) if ALL else (1, 50)
RENDERS = int(os.environ.get("PEELER_STALLED_RENDERS", 160 if ALL else 4))


def stalled(command, microseconds, one_in=1, threads=None):
    environment = {
        **os.environ,
        "LD_PRELOAD": os.environ["DRIVER_RACE"],
        "PEELER_GUARDED_SIZES": FENCES,
        "PEELER_STALL_MICROSECONDS": str(microseconds),
        "PEELER_STALL_ONE_IN": str(one_in),
    }
    environment.pop("LP_NUM_THREADS", None)
    if threads is not None:
        environment["LP_NUM_THREADS"] = str(threads)
    return subprocess.run(list(map(str, command)), env=environment, capture_output=True, text=True, check=False)


def stalls_of(done):
    found = re.search(r"^stalls: (\d+)$", done.stderr, re.MULTILINE)
    return int(found[1]) if found else 0


class Race(unittest.TestCase):
    def setUp(self):
        renderer = stalled([os.environ["FENCE_RACE"], "egl", "1"], 0).stdout
        if "llvmpipe" not in renderer:
            self.skipTest(f"this is not Mesa's rasteriser: {renderer}")

    @unittest.skipIf(SANITIZER, "nothing is mended where there is a sanitizer")
    def test_crashes_a_program_and_no_mended_one(self):
        for backend in BACKENDS:
            crashes = stalls = 0
            with self.subTest(backend=backend):
                for run in range(RUNS):
                    done = stalled([os.environ["FENCE_RACE"], backend, 20000], 500, threads=1)
                    crashes += done.returncode < 0
                    threads = (1, 2, 4)[run % 3]
                    mended = stalled([os.environ["FENCE_RACE_MENDED"], backend, STALLS], 500, threads=threads)
                    self.assertEqual(mended.returncode, 0, mended.stderr)
                    stalls += stalls_of(mended)
                print(f"{backend}: {crashes} of {RUNS} crash; mended none, {stalls} stalls", flush=True)
                self.assertEqual(crashes, RUNS, f"without the definition it ends well, too: {done.stdout}")
                self.assertGreaterEqual(stalls, RUNS * STALLS)

    @unittest.skipIf(SANITIZER, "nothing is mended where there is a sanitizer")
    def test_leaves_renders_as_they_are(self):
        scenes = sorted(SCENES.glob("*.glb"), key=lambda path: path.stat().st_size)[:4]
        pictures = list(itertools.product(("two-pass", "a-buffer"), scenes))[: max(1, RENDERS // 4)]
        stalls = 0
        with tempfile.TemporaryDirectory() as folder:

            def render(picture, microseconds, *options):
                """Returns (the file, the number of stalls)."""
                method, scene = picture
                out = pathlib.Path(folder, "out.exr")
                words = [os.environ["PEELER"], "render", scene, "-o", out, "--size", "48x36", "--method", method, *options]
                done = stalled(words, microseconds)
                self.assertEqual(done.returncode, 0, f"{words}: {done.stderr}")
                return out.read_bytes(), stalls_of(done)

            expected = {picture: render(picture, 0, "--threads", "1")[0] for picture in pictures}
            ways = itertools.cycle(itertools.product(pictures, ("2", "4"), BACKENDS))
            for picture, threads, backend in itertools.islice(ways, RENDERS):
                now, so_often = render(picture, 300, "--threads", threads, "--backend", backend)
                self.assertTrue(now == expected[picture], f"{picture}, {threads} threads, {backend}")
                stalls += so_often
        print(f"{RENDERS} renders of {len(pictures)} pictures, the same files, {stalls} stalls")
        self.assertGreater(stalls, RENDERS)

    @unittest.skipUnless(SANITIZER == "thread", "this is for ThreadSanitizer to report")
    def test_is_reported(self):
        with mock.patch.dict(os.environ, TSAN_OPTIONS=f"exitcode=99:suppressions={RACES}"):
            done = stalled([os.environ["FENCE_RACE"], "egl", 300], 500, threads=1)
        self.assertEqual(done.returncode, 99, done.stderr)
        self.assertIn("destroy of a locked mutex", done.stderr)


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # no core files after crashes
    unittest.main()
