# SPDX-License-Identifier: Apache-2.0
"""Tests that the examples at the top of every --help run as printed."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from peeler_command import EXAMPLES, PEELER, main, peeler

# Options that make an example faster without changing its purpose. If an option is repeated, its last value counts.
QUICK = {
    "render": "--size 64x36 --samples 1",
    "rays": "--resolution 32",
    "bake": "--resolution 32 --directions 4",
    "masks": "--size 64x36",
}
QUICK_SCENE_SHEET, QUICK_TEXTURE = "--size 64x36", "--size 64"


def quickly(verb, command):
    if verb == "sheet" and "scene.glb" in command:
        return f"{command} {QUICK_SCENE_SHEET}"
    if "--target texture" in command:
        command += " " + QUICK_TEXTURE
    return f"{command} {QUICK.get(verb, '')}"


def verbs():
    return re.findall(r"^  ([a-z]+) +[A-Z]", peeler("--help").stdout, re.M)


def examples(verb):
    text = peeler(verb, "--help", "all").stdout
    found = re.search(r"^Examples:\n((?:  .*\n)+)", text, re.M)
    return found.group(1).replace("\n  ", "\n").strip().splitlines() if found else []


class Examples(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "peeler").symlink_to(pathlib.Path(PEELER).resolve())
        shutil.copy(EXAMPLES / "scenes" / "jellyfish.glb", self.folder / "scene.glb")
        shutil.copy(EXAMPLES / "scenes" / "bracket.glb", self.folder / "part.glb")
        shutil.copy(EXAMPLES / "scenes" / "plant.glb", self.folder)  # this scene has texture coordinates
        picture = ["--size", "64x36"]
        self.make("scene.glb", "-o", "layers.exr", "--channels", "normal,id", *picture)
        self.make("scene.glb", "-o", "deep.exr", "--as", "deep", "--channels", "id", *picture)
        self.make("scene.glb", "-o", "frame.####.exr", "--frames", "1-2", *picture)
        for name in ("a.exr", "a.png"):
            self.make("scene.glb", "-o", name, *picture)
            shutil.copy(self.folder / name, self.folder / name.replace("a.", "b."))
        for tile in ("1", "2"):
            self.make("scene.glb", "-o", f"tile.{tile}.exr", "--tile", f"{tile}/2", *picture)
        (self.folder / "jobs.jsonl").write_text(
            '{"verb": "render", "args": ["scene.glb", "-o", "job.png"], "options": {"size": "64x36"}}\n'
        )

    def make(self, *arguments):
        done = peeler("render", *arguments, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_run(self):
        for verb in verbs():
            commands = examples(verb)
            self.assertEqual(len(commands), 3, verb)
            for command in commands:
                with self.subTest(command):
                    done = subprocess.run(
                        ["sh", "-eu", "-c", f"PATH=$PWD/bin:$PATH; {quickly(verb, command)}"],
                        cwd=self.folder, text=True, capture_output=True, check=False,
                    )
                    self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    sys.exit(main())
