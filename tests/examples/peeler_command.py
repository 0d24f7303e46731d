# SPDX-License-Identifier: Apache-2.0
"""Parts shared by the tests of examples/: the built program, scenes, reports of skipped tests."""

import hashlib
import os
import pathlib
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = SOURCE / "examples"
PEELER = os.environ.get("PEELER", "peeler")
SKIPPED = 77  # SKIP_RETURN_CODE of ctest


def animated_scene():
    """Returns a real walking model if the model collections exist; otherwise a swimming one from our examples."""
    assets = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")
    model = assets / "gltf-sample-assets" / "CesiumMan" / "glTF-Binary" / "CesiumMan.glb"
    if model.is_file():
        return model
    print("no models (PEELER_ASSETS, or ../shared/assets): examples/scenes/jellyfish.glb instead")
    return EXAMPLES / "scenes" / "jellyfish.glb"


def peeler(*arguments, **options):
    """Runs peeler. The result holds its output in .stdout and .stderr."""
    return subprocess.run(
        [PEELER, *map(str, arguments)], text=True, capture_output=True, check=False, **options
    )


def fingerprints(folder, pattern="*.exr"):
    """Returns {file name: hash of the file's bytes}."""
    files = sorted(pathlib.Path(folder).glob(pattern))
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


class PeelerTest(unittest.TestCase):
    maxDiff = 4000

    def render(self, *arguments):
        done = peeler("render", *arguments, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)

    def verify(self, folder, count):
        files = sorted(pathlib.Path(folder).glob("*.exr"))
        self.assertEqual(len(files), count)
        done = peeler("verify", *files)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def assert_nothing_else(self, folder, count):
        """Expects `count` files, and no others, such as temporary files."""
        self.assertEqual(len(os.listdir(folder)), count, os.listdir(folder))


def skip(reason):
    print(f"skipped: {reason}", flush=True)
    sys.exit(SKIPPED)


def main():
    """Runs the tests of the calling file, and returns the exit code."""
    program = unittest.main(module="__main__", exit=False, verbosity=2)
    return 0 if program.result.wasSuccessful() else 1
