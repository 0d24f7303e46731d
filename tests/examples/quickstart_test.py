# SPDX-License-Identifier: Apache-2.0
"""Tests the text of examples/quickstart.sh, with commands in place of the installation and the build."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main


class Quickstart(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def commands(self):
        """Writes a dpkg-query that lacks no package, and a cmake that builds a link to the tested peeler."""
        folder = self.folder / "bin"
        folder.mkdir()
        link = f"mkdir -p build/release && ln -sf {pathlib.Path(PEELER).resolve()} build/release/peeler"
        for name, line in (("dpkg-query", "echo install ok installed"), ("cmake", link)):
            (folder / name).write_text(f"#!/bin/sh\n{line}\n")
            (folder / name).chmod(0o755)
        return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}

    def test_it_says_what_it_does_where_the_pictures_are_and_what_to_try(self):
        for script in ("quickstart.sh", "install_dependencies.sh"):
            (self.folder / "examples/scenes").mkdir(parents=True, exist_ok=True)
            shutil.copy(EXAMPLES / script, self.folder / "examples")
        shutil.copy(EXAMPLES / "scenes/coincident.glb", self.folder / "examples/scenes/glasses.glb")  # quicker
        environment = self.commands()
        done = subprocess.run(
            ["sh", "examples/quickstart.sh"], cwd=self.folder, env=environment, text=True, capture_output=True, check=False
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        begin, end = done.stdout.split("channels")[0], done.stdout[done.stdout.index("The pictures") :]
        for words in ("installs the Debian packages", "about 4 minutes"):
            self.assertIn(words, begin)
        self.assertIn(f"{self.folder.resolve()}/build/quickstart", end)
        for picture in re.findall(r"^  (\S+\.\w+)  ", end, re.MULTILINE):
            self.assertTrue((self.folder / "build/quickstart" / picture).is_file(), picture)
        to_try = re.findall(r"^  (peeler .*)", end, re.MULTILINE)
        self.assertEqual(len(to_try), 3)
        for command in to_try[:2]:
            line = command.replace("peeler", str(PEELER), 1)
            tried = subprocess.run(["sh", "-c", line], cwd=self.folder, text=True, capture_output=True, check=False)
            self.assertEqual(tried.returncode, 0, tried.stderr)

    def test_the_configuration_does_not_mention_imaths_python(self):
        configure = ["cmake", "-S", SOURCE, "-B", self.folder / "build", "-DPEELER_BUILD_TESTS=OFF", "-DPEELER_PYTHON=OFF"]
        done = subprocess.run(configure, text=True, capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("PyImath", done.stdout + done.stderr)


if __name__ == "__main__":
    sys.exit(main())
