# SPDX-License-Identifier: Apache-2.0
"""Parts shared by the tests of the Python module: the module, the command line, scenes, folders."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SCENES = SOURCE / "examples" / "scenes"
BUILD = pathlib.Path(os.environ.get("PEELER", SOURCE / "build/ci/peeler")).parent
ALL = "PEELER_TEST_ALL" in os.environ

sys.path.insert(0, str(BUILD / "python"))
try:
    import numpy as np
    import peeler
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)


def scene(name, **keywords):
    return peeler.Scene(SCENES / f"{name}.glb", **keywords)


def command(*arguments):
    """Runs a command of peeler, and returns its output."""
    quiet = [] if arguments[0] == "info" else ["--quiet"]
    done = subprocess.run(
        [BUILD / "peeler", *map(str, arguments), *quiet],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise AssertionError(f"{arguments}: {done.stderr}")
    return done.stdout


def resident():
    """Returns the resident memory of this process, in bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def descriptors():
    return len(os.listdir("/proc/self/fd"))


def threads():
    return len(os.listdir("/proc/self/task"))


class ModuleTest(unittest.TestCase):
    """A test case with one Renderer per class and one folder per test."""

    @classmethod
    def setUpClass(cls):
        cls.r = peeler.Renderer()

    @classmethod
    def tearDownClass(cls):
        cls.r.close()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_same(self, a, b, what=""):
        """Expects bitwise equal numbers of the same type and shape."""
        a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
        self.assertEqual((a.dtype, a.shape), (b.dtype, b.shape), what)
        self.assertEqual(a.tobytes(), b.tobytes(), what)

    def assert_error(self, kind, work, *arguments, **keywords):
        with self.assertRaises(peeler.Error) as raised:
            work(*arguments, **keywords)
        self.assertEqual(raised.exception.kind, kind, raised.exception)
        return raised.exception
