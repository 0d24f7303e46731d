# SPDX-License-Identifier: Apache-2.0
"""Runs the commands in documents, one test per document (tests/README.md, "Commands in documents").

    python3 tests/examples/guide_test.py [DOCUMENT ...]

Commands that are not run are counted by reason in lines that begin with "left out: "."""

import collections
import dataclasses
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

from peeler_command import PEELER, SOURCE, main

PATTERNS = ("README.md", "*/README.md", "examples/*/*.md")
RUN, NO_RUN, PRINTED = "sh", "sh no-run: ", "text"
INDENTED = re.compile(r"(?: {4,}|\t)(?:\$ )?(?:peeler|sh|python3|cmake|docker|mkdir) ")
# Lines that depend on the machine: the chosen renderer, and times.
OF_THE_MACHINE = re.compile(r"peeler: (no GPU can be used, so .*|[a-z]+ +\d+ %)")
# Outputs with this text are not compared in sanitizer builds, which need another amount of memory.
OF_A_SANITIZER = "the memory budget is" if os.environ.get("PEELER_SANITIZE") else None


@dataclasses.dataclass
class Block:
    """A fenced block of a document, with the line number of its opening fence."""

    language: str
    line: int
    text: str

    def commands(self):
        """Returns the number of commands. Comments do not count; continued lines count once."""
        joined = self.text.replace("\\\n", "")
        return sum(1 for line in joined.splitlines() if line and not line.lstrip().startswith("#"))


class Wrong(Exception):
    """A violation of the document format that this test requires."""


def blocks(text):
    """Returns all fenced blocks of a document, in order."""
    found, opened = [], None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```") and opened is None:
            opened = Block(line[3:].strip(), number, "")
        elif line.startswith("```"):
            found.append(opened)
            opened = None
        elif opened is not None:
            opened.text += line + "\n"
        elif INDENTED.match(line):
            raise Wrong(f"line {number}: commands belong into a block of the language sh")
    if opened is not None:
        raise Wrong(f"line {opened.line}: the block has no end")
    for before, block in zip([None, *found], found):
        known = block.language in (RUN, PRINTED) or (
            block.language.startswith(NO_RUN) and block.language != NO_RUN
        )
        if not known:
            what = f"{block.language!r} is none of sh, text, sh no-run: WHY"
            raise Wrong(f"line {block.line}: {what}")
        if block.language == PRINTED and (before is None or before.language != RUN):
            raise Wrong(f"line {block.line}: no commands before it print this")
    return found


def printed(text):
    """Returns the part of an output that is compared."""
    lines = [line.rstrip() for line in text.splitlines()]
    return "".join(line + "\n" for line in lines if not OF_THE_MACHINE.fullmatch(line))


def pattern(expected):
    """Returns the regular expression for a text block. An ellipsis matches anything within its line; alone on a line,
    it matches any lines."""
    lines = []
    for line in expected.splitlines():
        anything = ".*?".join(map(re.escape, line.rstrip().split("…")))
        lines.append(r"(?:.*\n)*?" if line.strip() == "…" else anything + r"\n")
    return re.compile("".join(lines))


def first_difference(expected, output):
    """Returns the number and text of the first line of a text block that was not printed; 0 and "" if all were."""
    if pattern(expected).fullmatch(output):
        return 0, ""
    lines = expected.splitlines()
    for number in range(1, len(lines) + 1):
        if not pattern("\n".join([*lines[:number], "…"])).fullmatch(output):
            return number, lines[number - 1]
    return len(lines) + 1, "(the end)"


def left_out(found):
    """Returns one line per reason, with the number of commands left out."""
    counts = collections.Counter()
    for block in found:
        if block.language.startswith(NO_RUN):
            counts[block.language.removeprefix(NO_RUN)] += block.commands()
    return "".join(
        f"\nleft out: {count} command{'s' if count > 1 else ''}: {reason}"
        for reason, count in counts.items()
    )


def documents():
    return sorted({path for glob in PATTERNS for path in SOURCE.glob(glob)})


class Commands(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name, "here")
        programs = pathlib.Path(scratch.name, "bin")
        programs.mkdir()
        (programs / "peeler").symlink_to(shutil.which(PEELER))
        (programs / "python3").symlink_to("/usr/bin/python3")  # Debian's Python, which has numpy
        # A copy, because commands may write to the folder.
        shutil.copytree(SOURCE / "examples", self.folder / "examples")
        self.environment = {
            key: value
            for key, value in os.environ.items()
            if key not in ("DISPLAY", "WAYLAND_DISPLAY")
        }
        self.environment.update(
            PATH=f"{programs}:{os.environ['PATH']}",
            PYTHONPATH=str(pathlib.Path(shutil.which(PEELER)).resolve().parent / "python"),
            LC_ALL="C.UTF-8",
            PYTHONDONTWRITEBYTECODE="1",
        )

    def run_block(self, block):
        """Returns what the commands of a block print."""
        done = subprocess.run(
            ["sh", "-eu", "-c", block.text],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        if done.returncode != 0:
            self.fail(f"exit code {done.returncode}:\n{block.text}\nprints:\n{done.stdout}")
        return printed(done.stdout)

    def run_document(self, path):
        found = blocks(path.read_text(encoding="utf-8"))
        # ctest keeps only the beginning of a long output, so print the count first.
        print(left_out(found), flush=True)
        for block, after in zip(found, [*found[1:], None]):
            if block.language != RUN:
                continue
            with self.subTest(line=block.line):
                start = time.monotonic()
                output = self.run_block(block)
                print(f"{time.monotonic() - start:6.1f} s  {path.name}:{block.line}", flush=True)
                if after is None or after.language != PRINTED:
                    continue
                if OF_A_SANITIZER and OF_A_SANITIZER in after.text:
                    print(f"left out: {path.name}:{after.line}: its memory is not the product's", flush=True)
                    continue
                number, line = first_difference(after.text, output)
                if number:
                    where = f"{path}:{after.line + number}"
                    self.fail(f"{where}: {line}\nis not what it prints:\n{output}")


def add_test(path):
    name = "_".join(path.relative_to(SOURCE).with_suffix("").parts)
    setattr(Commands, f"test_{name}", lambda self: self.run_document(path))


class Reading(unittest.TestCase):
    """Proves that this test can fail."""

    def test_blocks(self):
        run = "```sh\ntrue\n```\n```text\nno\n```\n"
        found = blocks(run + "\n```sh no-run: a reason\na \\\n  b\n# c\nd\n```\n")
        self.assertEqual([block.language for block in found], [RUN, PRINTED, NO_RUN + "a reason"])
        self.assertEqual(left_out(found), "\nleft out: 2 commands: a reason")

    def test_what_is_not_written_right(self):
        for text in (
            *("```\na\n```", "```sh no-run\na\n```", "```text\na\n```", "```sh\na\n"),
            *("```sh no-run: why\na\n```\n```text\na\n```", "    peeler info out.exr"),
        ):
            self.assertRaises(Wrong, blocks, text)

    def test_output(self):
        def differs(expected, output):
            return first_difference(expected, output)[0]

        self.assertEqual(differs("a … b\n", "a 12 ms b\n"), 0)
        self.assertEqual(differs("a\n…\nb\n", "a\n1\n2\nb\n"), 0)
        self.assertEqual(differs("a\n…\nb\n", "a\n1\n2\n"), 3)
        self.assertEqual(differs("a.c\n", "abc\n"), 1)
        self.assertEqual(differs("a … b\n", "a 1\n2 b\n"), 1)
        self.assertEqual(differs("a\n", "a\nb\n"), 2)
        self.assertEqual(printed("peeler: render  30 %\npeeler: a  \n"), "peeler: a\n")


if __name__ == "__main__":
    for document in sys.argv[1:] or documents():
        add_test(SOURCE / document)
    del sys.argv[1:]
    sys.exit(main())
