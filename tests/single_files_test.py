# SPDX-License-Identifier: Apache-2.0
"""Tests that single_files.py detects a missing include, and succeeds otherwise."""

import contextlib
import io
import json
import pathlib
import tempfile
import unittest
from unittest import mock

import single_files

FILES = {
    "core/color.h": "#pragma once\nstruct Color { int red; };\n",
    "core/shape.h": '#pragma once\n#include "core/color.h"\nstruct Shape { Color color; };\n',
    "core/area.h": "#pragma once\nint area(int side);\n",
    "core/area.cpp": '#include "core/area.h"\nint area(int side) { return side * side; }\n',
    "core/draw.cpp": '#include "core/shape.h"\nint draw() { return Shape{{1}}.color.red; }\n',
}


class SingleFiles(unittest.TestCase):
    def run_on(self, changes, differ=(), headers_only=False):
        """Returns (exit code, output) for FILES with these changes. The files in `differ` are new, and all files form
        one unit."""
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder).resolve()
            for name, text in {**FILES, **changes}.items():
                (source / name).parent.mkdir(parents=True, exist_ok=True)
                (source / name).write_text(text)
            unit = source / "unity_0.cxx"
            unit.write_text("".join(f'#include "{file}"\n' for file in sorted(source.glob("core/*.cpp"))))
            command = f"c++ -std=c++20 -I{source} -I{source}/cmd/library/include -o unity_0.o -c {unit}"
            entry = {"directory": str(source), "command": command, "file": str(unit)}
            (source / "compile_commands.json").write_text(json.dumps([entry]))
            answers = {"merge-base": ["0123456789ab"], "rev-parse": ["another"], "diff": list(differ)}
            printed = io.StringIO()
            with mock.patch.object(single_files, "git", lambda _, command, *rest: answers.get(command, [])):
                with contextlib.redirect_stdout(printed):
                    code = single_files.main(source, headers_only, source)
            return code, printed.getvalue()

    def test_passes_where_each_includes_what_it_needs(self):
        code, printed = self.run_on({}, FILES)
        self.assertEqual(code, 0, printed)
        self.assertIn("3 of 3: 3 that differ from 0123456789", printed)

    def test_sees_it_in_a_file_that_differs(self):
        bad = {"core/draw.cpp": "int draw() { return Shape{{1}}.color.red; }\n"}
        code, printed = self.run_on(bad, bad)
        self.assertEqual(code, 1)
        self.assertIn("draw.cpp: does not compile by itself", printed)
        self.assertIn("Shape", printed)

    def test_sees_it_in_what_includes_a_header_that_differs(self):
        bad = {"core/shape.h": "#pragma once\nstruct Shape { Color color; };\n"}
        code, printed = self.run_on(bad, bad)
        self.assertEqual(code, 1)
        self.assertIn("draw.cpp: does not compile by itself", printed)

    def test_sees_it_in_what_includes_a_public_header_that_differs(self):
        public = {"cmd/library/include/peeler/size.h": "#pragma once\n"}
        bad = {**public, "core/draw.cpp": "#include <peeler/size.h>\nint draw() { return Size{1}.width; }\n"}
        code, printed = self.run_on(bad, public)
        self.assertEqual(code, 1)
        self.assertIn("1 that differ", printed)
        self.assertIn("draw.cpp: does not compile by itself", printed)

    def test_sees_it_in_a_header_that_no_file_includes_first(self):
        bad = {"core/color.h": "#pragma once\nstruct Color { std::uint8_t red; };\n"}
        for code, printed in (self.run_on(bad, bad), self.run_on(bad, headers_only=True)):
            self.assertEqual(code, 1)
            self.assertIn("color.h: does not compile by itself", printed)

    def test_comes_to_the_others_in_the_time_that_is_left(self):
        bad = {"core/draw.cpp": "int draw() { return Shape{{1}}.color.red; }\n"}
        self.assertEqual(self.run_on(bad)[0], 1)
        with mock.patch.object(single_files, "SECONDS", 0):
            code, printed = self.run_on(bad)
            self.assertEqual(code, 0)
            self.assertIn("0 of 4: 0 that differ", printed)
            self.assertEqual(self.run_on(bad, bad)[0], 1)


if __name__ == "__main__":
    unittest.main()
