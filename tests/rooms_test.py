# SPDX-License-Identifier: Apache-2.0
"""Which room of the source may include which: the rooms stand in a table in core/README.md,
formats/README.md and cmd/README.md, and each may include itself and those above it, of core/ also
formats/ and cmd/, of formats/ also cmd/. No headers include each other in a circle. Files stay short."""

import pathlib
import re
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = ("core", "formats", "cmd")  # each may include those before it
MOST_HEADERS = 165
MOST_LINES = 450
INCLUDE = re.compile(r'^#include "((?:core|formats|cmd)/[^"]+)"', re.MULTILINE)
ROOM = re.compile(r"^\| `((?:core|formats|cmd)[\w/]*)` \|", re.MULTILINE)


def rooms(source):
    """All rooms, from the lowest, as the READMEs list them."""
    return [
        room
        for library in LIBRARIES
        for room in ROOM.findall((source / library / "README.md").read_text(encoding="utf-8"))
    ]


def files(source):
    """{path: what it includes of ours}"""
    found = {}
    for library in LIBRARIES:
        for path in sorted((source / library).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                text = path.read_text(encoding="utf-8")
                found[path.relative_to(source).as_posix()] = INCLUDE.findall(text)
    return found


def room_of(path):
    return path.rpartition("/")[0]


def back_arrows(source):
    """Includes of a room that stands below the one that includes it, or in no table."""
    order = {room: place for place, room in enumerate(rooms(source))}
    errors = []
    for path, included in files(source).items():
        if room_of(path) not in order:
            errors.append(f"{room_of(path)}, the room of {path}, is in no README")
            continue
        for other in included:
            if order.get(room_of(other), len(order)) > order[room_of(path)]:
                errors.append(f"{path} includes {other}")
    return errors


def circle(source):
    """Files that include each other in a circle; empty if there is none."""
    graph = files(source)
    done = set()

    def visit(path, way):
        if path in way:
            return [*way[way.index(path) :], path]
        if path in done:
            return []
        for other in graph.get(path, []):
            found = visit(other, [*way, path])
            if found:
                return found
        done.add(path)
        return []

    return next((found for path in graph if (found := visit(path, []))), [])


class Rooms(unittest.TestCase):
    def test_includes_point_up_the_tables(self):
        self.assertEqual(back_arrows(SOURCE), [])

    def test_no_circles(self):
        self.assertEqual(circle(SOURCE), [])

    def test_every_room_of_the_tables_is_there(self):
        for room in rooms(SOURCE):
            self.assertTrue((SOURCE / room).is_dir(), room)

    def test_few_headers(self):
        headers = [path for path in files(SOURCE) if path.endswith(".h")]
        self.assertLessEqual(len(headers), MOST_HEADERS)

    def test_files_are_short(self):
        """A longer one says why in its first lines: "Longer than others because …"."""
        for path in files(SOURCE):
            text = (SOURCE / path).read_text(encoding="utf-8")
            if text.count("\n") > MOST_LINES:
                self.assertIn("Longer than others because", text[:1000], path)


class Planted(unittest.TestCase):
    """What the tests above are there for is seen."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.source = pathlib.Path(folder.name)
        for library in LIBRARIES:
            self.write(f"{library}/README.md", f"| `{library}/low` | x |\n| `{library}/high` | x |\n")

    def write(self, path, text):
        (self.source / path).parent.mkdir(parents=True, exist_ok=True)
        (self.source / path).write_text(text, encoding="utf-8")

    def test_back_arrow(self):
        self.write("core/high/a.h", '#include "core/low/b.h"\n')
        self.write("core/low/b.h", "")
        self.assertEqual(back_arrows(self.source), [])
        self.write("core/low/b.h", '#include "core/high/a.h"\n')
        self.assertEqual(back_arrows(self.source), ["core/low/b.h includes core/high/a.h"])

    def test_back_arrow_between_libraries(self):
        self.write("core/high/a.cpp", '#include "cmd/low/b.h"\n')
        self.assertEqual(back_arrows(self.source), ["core/high/a.cpp includes cmd/low/b.h"])

    def test_unknown_room(self):
        self.write("cmd/attic/a.h", "")
        self.assertEqual(len(back_arrows(self.source)), 1)

    def test_circle(self):
        self.write("core/low/a.h", '#include "core/low/b.h"\n')
        self.write("core/low/b.h", '#include "core/low/c.h"\n')
        self.write("core/low/c.h", "")
        self.assertEqual(circle(self.source), [])
        self.write("core/low/c.h", '#include "core/low/a.h"\n')
        self.assertEqual(set(circle(self.source)), {f"core/low/{name}.h" for name in "abc"})


if __name__ == "__main__":
    unittest.main()
