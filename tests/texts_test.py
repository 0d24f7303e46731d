# SPDX-License-Identifier: Apache-2.0
"""Texts of core and formats speak of the API, and the command line knows what it calls each name there."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = ("core", "formats", "cmd/library/include")
TABLE = SOURCE / "cmd/cli/api_names.cpp"

TOKEN = re.compile(
    r"""//[^\n]*|/\*.*?\*/
      | \#[ ]*include[^\n]*
      | R"(?P<mark>[^\s()\\]*)\((?P<raw>.*?)\)(?P=mark)"
      | "(?P<text>(?:\\.|[^"\\\n])*)"
      | '(?:\\.|[^'\\\n])+'
      | \b[0-9][0-9A-Za-z_.']*
      | (?P<space>\s+)
      | .""",
    re.DOTALL | re.VERBOSE,
)
FLAG = re.compile(r"--[A-Za-z]")
BACKQUOTED = re.compile(r"`([^`]*)`")
ROW = re.compile(r'^    \{"([^"]+)", "([^"]+)"\},$', re.MULTILINE)
OF_ANOTHER_PROGRAM = re.compile(r"\boiiotool IN --scanline\b")


def texts(code):
    """[(line, text)] of the string literals of a file; those that stand side by side are one."""
    found, joins, line = [], False, 1
    for token in TOKEN.finditer(code):
        text = token["raw"] if token["raw"] is not None else token["text"]
        if text is not None and joins:
            found[-1] = (found[-1][0], found[-1][1] + text)
        elif text is not None:
            found.append((line, text))
        joins = text is not None or (joins and token["space"] is not None)
        line += token[0].count("\n")
    return found


def texts_of(source):
    """[(place, text)] of core and formats, and of the public headers"""
    return [
        (f"{path.relative_to(source).as_posix()}:{line}", text)
        for library in LIBRARIES
        for path in sorted((source / library).rglob("*"))
        if path.suffix in (".h", ".cpp")
        for line, text in texts(path.read_text(encoding="utf-8"))
    ]


def of_the_command_line(found, verbs):
    """What names options or verbs."""
    a_verb = re.compile(rf"\bpeeler ({'|'.join(sorted(verbs))})\b")
    return [
        f"{place}: \"{text}\""
        for place, text in found
        if FLAG.search(OF_ANOTHER_PROGRAM.sub("", text)) or a_verb.search(text)
    ]


def names(found):
    """{name: place} of what stands in backquotes"""
    return {name: place for place, text in found for name in BACKQUOTED.findall(text)}


def verbs_of(source):
    return {path.stem for path in (source / "cmd").glob("*.cpp")} - {"main", "verbs"}


class Texts(unittest.TestCase):
    def setUp(self):
        self.found = texts_of(SOURCE)
        self.table = [name for name, _ in ROW.findall(TABLE.read_text(encoding="utf-8"))]
        self.assertGreater(len(self.found), 1000)
        self.assertGreater(len(self.table), 30)

    def test_they_name_neither_options_nor_verbs(self):
        errors = of_the_command_line(self.found, verbs_of(SOURCE))
        if errors:
            self.fail("the API has no command line; name the field in backquotes\n" + "\n".join(errors))

    def test_the_command_line_knows_every_name(self):
        missing = {name: place for name, place in names(self.found).items() if name not in self.table}
        self.assertEqual(missing, {}, f"not in {TABLE.name}")

    def test_every_name_stands_in_a_text(self):
        self.assertEqual(set(self.table) - set(names(self.found)), set())

    def test_the_table_is_sorted_and_has_a_name_once(self):
        self.assertEqual(self.table, sorted(set(self.table)))


class PlantedTexts(unittest.TestCase):
    """The checks can fail."""

    def test_literals_are_found_among_the_rest(self):
        code = (
            '#include "a--b.h"\n'
            '// "a --comment"\n'
            "/* \"a\n--comment\" */ int a = 1'000, b = 0xFF'FFu; char c = '\"', d = '\\'';\n"
            'f("it\'s \\"one\\"", "two"\n'
            '  " and --three" ,"four" R"x(a "raw" one)x");\n'
        )
        self.assertEqual(
            texts(code), [(5, 'it\'s \\"one\\"'), (5, "two and --three"), (6, 'foura "raw" one')]
        )

    def test_the_command_line(self):
        def refused(text):
            return of_the_command_line([("a.cpp:1", text)], {"info", "render"}) != []

        for text in ("give --size", "--size", "see peeler info", "a --b; oiiotool IN --scanline"):
            self.assertTrue(refused(text), text)
        for text in ("give `size`", "a -- b", "a part of peeler is missing", "oiiotool IN --scanline"):
            self.assertFalse(refused(text), text)

    def test_names(self):
        self.assertEqual(names([("a", "`b` or `c`"), ("d", "e")]), {"b": "a", "c": "a"})


if __name__ == "__main__":
    unittest.main()
