# SPDX-License-Identifier: Apache-2.0
"""Tests both commands of the README on a fresh Debian 13, and a build without a preset: with another compiler, Mesa and
libraries. Runs only with PEELER_TEST_ALL, because it installs and compiles everything, which takes as long as a short
run of the tests."""

import os
import pathlib
import shutil

import debian
import dockerfile
import own_machine
from peeler_command import SOURCE, main, skip

SUITE = "trixie"
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")


class Debian13(debian.RootsTest):
    NEEDED = 11e9

    def test_quickstart_short_run_and_plain_build(self):
        debian.make_root(SUITE, f"{self.scratch}/base")
        root = dockerfile.Stage(f"{self.scratch}/base", f"{self.scratch}/root")
        shutil.rmtree(f"{self.scratch}/base")
        debian.copy_sources(root.root)
        root.folder = "/peeler"
        # The style check needs git and Debian 12's clang-format.
        root.variables["PEELER_STYLE"] = "unchecked"
        if ASSETS.is_dir():
            pathlib.Path(root.root, "assets").mkdir()
            own_machine.mount(str(ASSETS), f"{root.root}/assets", "none", flags=own_machine.MS_BIND)
            root.variables["PEELER_ASSETS"] = "/assets"
        plain = "rm -rf build/* && sh tests/run.sh plain"  # frees the memory of the files first
        for command in ("sh examples/quickstart.sh", "sh tests/run.sh", plain):
            with self.subTest(command):
                done = root.run(["sh", "-c", command])
                shown = done.stdout[-2500:] if done.returncode == 0 else done.stdout
                self.say(f"{command}\n{shown}")
                self.assertEqual(done.returncode, 0)


if __name__ == "__main__":
    if not os.environ.get("PEELER_TEST_ALL"):
        skip("a Debian 13 of its own is only made with PEELER_TEST_ALL (sh tests/run.sh all)")
    debian.in_own_machine("debian13", main, SUITE, Debian13.NEEDED)
