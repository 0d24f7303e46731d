# SPDX-License-Identifier: Apache-2.0
"""Tests examples/opencue/peeler_outline.py by running every command line that it submits.

Debian has no PyOutline, so the test replaces it by a module that records its arguments.
"""

import os
import pathlib
import runpy
import subprocess
import sys
import tempfile
import types
import unittest.mock

from peeler_command import EXAMPLES, PEELER, PeelerTest, animated_scene, fingerprints, main

SCRIPT = str(EXAMPLES / "opencue" / "peeler_outline.py")


class Shell:
    """A stand-in for outline.modules.shell.Shell, with the arguments of outline.layer.Layer."""

    KNOWN = {"command", "range", "chunk", "memory", "threadable", "env", "service", "tags"}

    def __init__(self, name, **arguments):
        assert not arguments.keys() - self.KNOWN, arguments
        self.name, self.arguments, self.after = name, arguments, []

    def depend_all(self, layer):
        self.after.append(layer.name)


class Outline:
    def __init__(self, name):
        self.name, self.layers = name, []

    def add_layer(self, layer):
        self.layers.append(layer)


def submitted(*arguments):
    """Returns the outline that the script launches with these arguments."""
    launched = []

    def launch(job, use_pycuerun=True):
        # With pycuerun, Cuebot would get pycuerun's command line, which has no #FRAMESPEC#.
        assert not use_pycuerun
        launched.append(job)

    modules = {
        name: types.ModuleType(name)
        for name in ("outline", "outline.cuerun", "outline.modules", "outline.modules.shell")
    }
    modules["outline"].Outline = Outline
    modules["outline"].cuerun = modules["outline.cuerun"]
    modules["outline"].modules = modules["outline.modules"]
    modules["outline.modules"].shell = modules["outline.modules.shell"]
    modules["outline.modules.shell"].Shell = Shell
    modules["outline.cuerun"].launch = launch
    with unittest.mock.patch.dict(sys.modules, modules), unittest.mock.patch.object(
        sys, "argv", [SCRIPT, *map(str, arguments)]
    ):
        runpy.run_path(SCRIPT, run_name="__main__")
    return launched[0]


def frame_specs(text, chunk):
    """Yields the first frame of each chunk, and Cuebot's text for #FRAMESPEC# (FrameSet.getChunk). `text` is one range,
    optionally with a step, so every chunk is a range or a single frame too."""
    numbers, _, step = text.partition("x")
    first, last = (int(number) for number in (numbers.split("-") * 2)[:2])
    frames = range(first, last + 1, int(step or 1))
    for at in range(0, len(frames), chunk):
        part = frames[at : at + chunk]
        spec = f"{part[0]}-{part[-1]}" + (f"x{part.step}" if part.step != 1 else "")
        yield part[0], spec if len(part) > 1 else str(part[0])


def command_lines(job):
    """Yields the command lines in dependency order. PyOutline's serialize_simple joins the words with spaces, and
    Cuebot's DispatchSupportService.prepareRqdRunFrame replaces the tokens."""
    done = []
    for layer in job.layers:
        assert not set(layer.after) - set(done)
        chunk = layer.arguments.get("chunk", 1)
        for first, spec in frame_specs(layer.arguments["range"], chunk):
            line = " ".join(layer.arguments["command"])
            for token, value in (
                ("ZFRAME", f"{first:04d}"),
                ("IFRAME", first),
                ("FRAME_START", first),
                ("FRAME_END", first + chunk - 1),
                ("FRAME_CHUNK", chunk),
                ("LAYER", layer.name),
                ("JOB", job.name),
                ("FRAMESPEC", spec),
                ("FRAME", f"{first:04d}-{layer.name}"),
            ):
                line = line.replace(f"#{token}#", str(value))
            yield line
        done.append(layer.name)


class OpenCue(PeelerTest):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def test_job(self):
        frames = self.folder / "it's the [1] folder"  # a name that an unquoted shell word would split
        frames.mkdir()
        scene = animated_scene()
        job = submitted(
            scene,
            frames / "my walk.####.exr",
            "3-29x2",
            "--chunk",
            "4",
            "--peeler",
            PEELER,
            "--",
            "--size",
            "160x120",
        )
        lines = list(command_lines(job))
        self.assertEqual(len(lines), 5)
        self.assertEqual(
            [line.split("--frames=")[1].split("'")[0] for line in lines[:4]],
            ["3-9x2", "11-17x2", "19-25x2", "27-29x2"],
        )
        for line in lines:
            print(line)
            # RQD writes the line to a file, and runs the file with a shell in any folder.
            (self.folder / "rqd-cmd").write_text(line)
            done = subprocess.run(
                ["sh", str(self.folder / "rqd-cmd")],
                cwd="/",
                text=True,
                capture_output=True,
                check=False,
                env={**os.environ, "CUE_THREADS": "1"},
            )
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("good", done.stdout)

        self.verify(frames, 14)
        self.assert_nothing_else(frames, 14)
        (self.folder / "whole").mkdir()
        self.render(
            scene,
            "-o",
            self.folder / "whole" / "my walk.####.exr",
            "--size",
            "160x120",
            "--frames=3-29x2",
        )
        self.assertEqual(fingerprints(frames), fingerprints(self.folder / "whole"))

        pictures = self.folder / "walk.####.png"
        files = frames / "my walk.####.exr"
        job = submitted("--verb", "flatten", files, pictures, "3-9x2", "--chunk", "2", "--peeler", PEELER)
        self.assertEqual([layer.name for layer in job.layers], ["flatten"])
        for line in command_lines(job):
            subprocess.run(["sh", "-c", line], cwd="/", check=True, capture_output=True)
        self.assertEqual(len(list(self.folder.glob("walk.*.png"))), 4)


if __name__ == "__main__":
    sys.exit(main())
