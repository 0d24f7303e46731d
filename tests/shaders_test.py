# SPDX-License-Identifier: Apache-2.0
"""Tests that shaders/README.md lists every shader file, every buffer that shaders write (with the barrier before it is
read), and every macro that shaders test (with the place that defines it)."""

import fnmatch
import pathlib
import re
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
SUFFIXES = (".glsl", ".vert", ".frag", ".comp")
COMMENT = re.compile(r"//[^\n]*")
CONDITION = re.compile(r"^ *#(?:ifdef|ifndef|if|elif)\b(.*)$", re.MULTILINE)
DEFINITION = re.compile(r"^ *#define (\w+)", re.MULTILINE)
UPPER_CASE = re.compile(r"\b[A-Z][A-Z0-9_]{2,}\b")
NAME = re.compile(r"`([\w*]+)`")
FILE = re.compile(r"`([\w/]+\.\w+)`")
WRITABLE = re.compile(r"layout\(std430, binding = (\w+)\) (?:writeonly )?buffer\b")


def shaders(source):
    """Returns {name: text without comments}."""
    return {
        path.name: COMMENT.sub("", path.read_text(encoding="utf-8"))
        for path in sorted((source / "shaders").iterdir())
        if path.suffix in SUFFIXES
    }


def macros(source):
    """Returns all macros: those in conditions and definitions, and all other names in capitals."""
    found = set()
    for text in shaders(source).values():
        for condition in CONDITION.findall(text):
            found.update(re.findall(r"\b(?!defined\b)[A-Za-z_]\w*", condition))
        found.update(DEFINITION.findall(text))
        found.update(UPPER_CASE.findall(text))
    return found - {"__cplusplus"}


def rows(source):
    """Returns {macro or pattern: (the files that set it, its meaning)} from the README."""
    readme = (source / "shaders/README.md").read_text(encoding="utf-8")
    found = {}
    setters = ""
    for line in readme.partition("## Macros")[2].splitlines():
        if line.startswith("`") and line.endswith(":"):
            setters = line
        elif line.startswith("- `"):
            names, _, meaning = line.partition(": ")
            found.update({name: (setters, meaning) for name in NAME.findall(names)})
    return found


def unlisted(source):
    patterns = rows(source)
    return sorted(
        macro for macro in macros(source) if not any(fnmatch.fnmatchcase(macro, p) for p in patterns)
    )


def unused(source):
    found = macros(source) | {"INCLUDED_x"}  # GLSL never sees these macros
    return sorted(p for p in rows(source) if not fnmatch.filter(found, p))


def not_set(source):
    """Returns the macros that the table attributes to a file in which they do not occur."""
    errors = []
    for pattern, (setters, _) in rows(source).items():
        for path in FILE.findall(setters):
            word = re.compile(r"\b" + re.escape(pattern).replace(r"\*", r"\w*") + r"\b")
            if not word.search((source / path).read_text(encoding="utf-8")):
                errors.append(f"{pattern}: {path}")
    return errors


def section(source, title):
    readme = (source / "shaders/README.md").read_text(encoding="utf-8")
    return readme.partition(f"## {title}\n")[2].partition("\n## ")[0]


def written(source):
    """Returns {(buffer, shader that may write it)}, from the shaders."""
    return {(buffer, name) for name, text in shaders(source).items() for buffer in WRITABLE.findall(text)}


def left(source):
    """Returns {(buffer, shader that may write it)}, from the lists of barriers."""
    found = set()
    buffer = ""
    for line in section(source, "What passes leave to each other").splitlines():
        if line.startswith("`") and line.endswith("`:"):
            (buffer,) = NAME.findall(line)
        elif line.startswith("- `"):
            writers, readers, between = line.removeprefix("- ").split("; ")
            if readers and between:
                found.update((buffer, writer) for writer in FILE.findall(writers))
    return found


class Readme(unittest.TestCase):
    def test_every_buffer_that_is_written_is_listed(self):
        self.assertEqual(written(SOURCE), left(SOURCE))

    def test_every_file_is_listed(self):
        table = section(SOURCE, "Files")
        items = re.findall(r"^- (`[^:]+`): ", table, re.MULTILINE)
        listed = re.findall(r"`([\w.]+)`", " ".join(items))
        self.assertEqual(sorted(listed), sorted(shaders(SOURCE)))

    def test_every_macro_is_listed(self):
        self.assertEqual(unlisted(SOURCE), [])

    def test_no_row_is_stale(self):
        self.assertEqual(unused(SOURCE), [])

    def test_macros_are_set_where_the_table_says(self):
        self.assertEqual(not_set(SOURCE), [])

    def test_every_row_says_who_and_what(self):
        for macro, (setter, meaning) in rows(SOURCE).items():
            self.assertTrue(setter and meaning, macro)


class Planted(unittest.TestCase):
    """Proves that the tests above can fail."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.source = pathlib.Path(folder.name)
        (self.source / "shaders").mkdir()
        self.write("shaders/a.frag", "#ifdef ROUGH\nint x = PEELER_A;\n#endif\n")
        self.write("set.cpp", '"ROUGH" PEELER_A')
        self.write(
            "shaders/README.md",
            "## Macros\n`set.cpp`:\n\n- `ROUGH`: rough\n- `PEELER_*`: a\n",
        )

    def write(self, path, text):
        (self.source / path).write_text(text, encoding="utf-8")

    def test_unlisted(self):
        self.assertEqual(unlisted(self.source), [])
        self.write("shaders/b.frag", "#if defined(SMOOTH) // ROUGHER\n#endif\n")
        self.assertEqual(unlisted(self.source), ["SMOOTH"])

    def test_unused(self):
        self.assertEqual(unused(self.source), [])
        self.write("shaders/a.frag", "int x = PEELER_A;  // ROUGH\n")
        self.assertEqual(unused(self.source), ["ROUGH"])

    def test_written(self):
        self.write("shaders/b.frag", "layout(std430, binding = PEELER_A) buffer A { uint a[]; };")
        self.write("shaders/c.frag", "layout(std430, binding = PEELER_A) readonly buffer A { uint a[]; };")
        self.assertEqual(written(self.source), {("PEELER_A", "b.frag")})
        self.assertEqual(left(self.source), set())
        self.write(
            "shaders/README.md", "## What passes leave to each other\n`PEELER_A`:\n\n- `b.frag`; CPU; wait\n"
        )
        self.assertEqual(left(self.source), written(self.source))

    def test_not_set(self):
        self.assertEqual(not_set(self.source), [])
        self.write("set.cpp", "PEELER_A")
        self.assertEqual(not_set(self.source), ["ROUGH: set.cpp"])


if __name__ == "__main__":
    unittest.main()
