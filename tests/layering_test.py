# SPDX-License-Identifier: Apache-2.0
"""Tests that includes follow the order of the rooms in the lists of core, formats and cmd."""

import pathlib
import re
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = ("core", "formats", "cmd")  # each may include itself and the libraries before it
FROM_THE_ROOT = ("core/", "formats/", "cmd/", "shaders/")
PUBLIC = "cmd/library/include/"  # other code includes these headers in angle brackets, relative to this folder
CODE = (".h", ".cpp")

ITEM = re.compile(r"^- ((?:`[\w/]+`(?:, )?)+)", re.MULTILINE)
ROOM = re.compile(r"`((?:core|formats|cmd)(?:/\w+)*)`")
INCLUDE = re.compile(r'^ *# *include (?:"([^"]+)"|<(peeler/[^>]+)>)')
EXPORTS = "#pragma GCC visibility push(default)\n"


def files(source, folders, suffixes):
    return sorted(p for f in folders for p in (source / f).rglob("*") if p.suffix in suffixes)


def rooms(source):
    """Returns the rooms of the three lists, in their order: a room may include only earlier ones."""
    found = []
    for library in LIBRARIES:
        text = (source / library / "README.md").read_text(encoding="utf-8")
        for item in ITEM.findall(text.partition("## Rooms")[2].partition("\n## ")[0]):
            found += ROOM.findall(item)
    return found


def room_of(path):
    return path.rpartition("/")[0]


def includes(source):
    """Returns [(file, line, included file)] for the includes of our own files in the product."""
    found = []
    for path in files(source, LIBRARIES, CODE):
        name = path.relative_to(source).as_posix()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            included = INCLUDE.match(line)
            target = included and (included[1] or PUBLIC + included[2])
            if target and target.partition("/")[0] in LIBRARIES:
                found.append((name, number, target))
    return found


def not_from_the_root(source):
    """Returns the includes of our own files by a shorter path, which the other checks would miss."""
    errors = []
    for path in files(source, LIBRARIES, CODE):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            included = INCLUDE.match(line)
            if included and included[1] and not included[1].startswith(FROM_THE_ROOT):
                name = path.relative_to(source).as_posix()
                errors.append(f"{name}:{number}: \"{included[1]}\" is no path from the root")
    return errors


def exports(source):
    """Returns the public headers that export nothing, and the other files that export something."""
    errors = []
    for path in files(source, LIBRARIES, CODE):
        name = path.relative_to(source).as_posix()
        shares = EXPORTS in path.read_text(encoding="utf-8")
        if shares != name.startswith(PUBLIC):
            errors.append(f"{name}: {'is not public, but shares names' if shares else 'is public, but shares nothing'}")
    return errors


def lists_and_folders(source):
    """Returns the rooms in a list that have no code, and the folders with code that are not rooms."""
    told = rooms(source)
    there = {
        path.parent.relative_to(source).as_posix() for path in files(source, LIBRARIES, CODE)
    }
    errors = [f"{room}: stands twice in the list" for room in set(told) if told.count(room) > 1]
    errors += [f"{room}: in the list, but there is no such room" for room in set(told) - there]
    for room in there - set(told):
        errors.append(f"{room}: not in the list of {room.partition('/')[0]}/README.md")
    return sorted(errors)


def back_arrows(order, arrows, verbs=()):
    """Returns the includes that violate the order of rooms. `verbs` are the rooms that may not include each other."""
    errors = []
    for name, line, included in arrows:
        room, other = room_of(name), room_of(included)
        arrow = f"{name}:{line}: {room} -> {other} ({included})"
        if room not in order or other not in order:
            errors.append(f"{arrow}: no such room")
        elif order.index(other) > order.index(room):
            errors.append(f"{arrow} points back: {other} stands below {room}")
        elif room != other and room in verbs and other in verbs:
            errors.append(f"{arrow}: rooms of verbs do not include each other")
    return errors


def cycle(graph):
    """Returns a cycle in {node: nodes} as a list that ends where it begins; nothing if there is no cycle."""
    done = set()
    for start in sorted(graph):
        path, stack = [], [(start, None)]
        while stack:
            node, rest = stack.pop()
            if rest is None:
                if node in path:
                    return path[path.index(node) :] + [node]
                if node in done:
                    continue
                path.append(node)
                rest = sorted(graph.get(node, ()))
            if rest:
                stack += [(node, rest[1:]), (rest[0], None)]
            else:
                done.add(node)
                path.pop()
    return []


def cycles(arrows):
    """Returns a cycle of files and a cycle of rooms, if there are any, with the includes that close them."""
    errors = []
    for what, end in (("files", lambda name: name), ("rooms", room_of)):
        graph, places = {}, {}
        for name, line, included in arrows:
            if what == "files" or end(name) != end(included):
                graph.setdefault(end(name), set()).add(end(included))
                places.setdefault((end(name), end(included)), f"{name}:{line}")
        path = cycle(graph)
        if path:
            steps = [f"{a} -> {b} ({places[a, b]})" for a, b in zip(path, path[1:])]
            errors.append(f"a cycle of {what}: " + ", ".join(steps))
    return errors


def verb_rooms(source):
    """Returns the rooms of the verbs. A room has the name of its verb's source: cmd/rays for cmd/rays.cpp."""
    return [room for room in rooms(source) if (source / f"{room}.cpp").is_file()]


class Rooms(unittest.TestCase):
    def assertNone(self, errors):
        if errors:
            self.fail("\n" + "\n".join(errors))

    def test_every_room_is_in_its_list(self):
        self.assertNone(lists_and_folders(SOURCE))

    def test_includes_are_paths_from_the_root(self):
        self.assertNone(not_from_the_root(SOURCE))

    def test_public_headers_alone_share_names(self):
        self.assertNone(exports(SOURCE))

    def test_no_arrow_points_back(self):
        arrows = includes(SOURCE)
        self.assertGreater(len(arrows), 500)
        self.assertNone(back_arrows(rooms(SOURCE), arrows, verb_rooms(SOURCE)))

    def test_there_is_no_cycle(self):
        self.assertNone(cycles(includes(SOURCE)))


class PlantedIncludes(unittest.TestCase):
    """Proves that the checks of includes can fail."""

    ORDER = ["core/base", "core/gl", "formats/exr", "formats", "cmd/cli", "cmd/bake", "cmd/rays", "cmd"]
    ARROWS = [
        ("core/gl/context.h", 3, "core/base/names.h"),
        ("core/gl/context.h", 4, "core/gl/objects.h"),
        ("formats/exr/files.cpp", 3, "core/gl/context.h"),
        ("cmd/rays/hits.cpp", 5, "cmd/cli/parse.h"),
        ("cmd/rays.cpp", 5, "cmd/rays/hits.h"),
    ]

    def arrows(self, *planted):
        return back_arrows(self.ORDER, self.ARROWS + list(planted), ["cmd/bake", "cmd/rays"])

    def test_what_is_allowed(self):
        self.assertEqual(self.arrows(), [])
        self.assertEqual(cycles(self.ARROWS), [])

    def test_an_arrow_to_a_room_below(self):
        self.assertEqual(
            self.arrows(("core/base/names.h", 7, "core/gl/context.h")),
            [
                "core/base/names.h:7: core/base -> core/gl (core/gl/context.h)"
                " points back: core/gl stands below core/base"
            ],
        )

    def test_an_arrow_to_a_library_below(self):
        for name, included in (
            ("core/gl/context.h", "formats/writers.h"),
            ("core/gl/context.h", "cmd/cli/parse.h"),
            ("formats/writers.h", "cmd/cli/parse.h"),
        ):
            (error,) = self.arrows((name, 7, included))
            self.assertIn(f"{name}:7: {room_of(name)} -> {room_of(included)} ({included})", error)

    def test_an_arrow_between_rooms_of_verbs(self):
        (error,) = self.arrows(("cmd/rays/hits.cpp", 7, "cmd/bake/values.h"))
        self.assertIn("cmd/rays/hits.cpp:7: cmd/rays -> cmd/bake (cmd/bake/values.h)", error)

    def test_an_arrow_out_of_every_room(self):
        (error,) = self.arrows(("cmd/main.cpp", 7, "cmd/attic/old.h"))
        self.assertIn("cmd/main.cpp:7: cmd -> cmd/attic (cmd/attic/old.h): no such room", error)

    def test_a_cycle_of_files(self):
        planted = [
            ("core/gl/objects.h", 8, "core/gl/program.h"),
            ("core/gl/program.h", 9, "core/gl/context.h"),
        ]
        self.assertEqual(
            cycles(self.ARROWS + planted),
            [
                "a cycle of files: core/gl/context.h -> core/gl/objects.h (core/gl/context.h:4),"
                " core/gl/objects.h -> core/gl/program.h (core/gl/objects.h:8),"
                " core/gl/program.h -> core/gl/context.h (core/gl/program.h:9)"
            ],
        )
        (itself,) = cycles([("core/gl/context.h", 2, "core/gl/context.h")])
        self.assertIn("core/gl/context.h -> core/gl/context.h (core/gl/context.h:2)", itself)

    def test_a_cycle_of_rooms(self):
        self.assertEqual(
            cycles(self.ARROWS + [("core/base/parallel.h", 6, "core/gl/functions.h")]),
            [
                "a cycle of rooms: core/base -> core/gl (core/base/parallel.h:6),"
                " core/gl -> core/base (core/gl/context.h:3)"
            ],
        )


class PlantedFiles(unittest.TestCase):
    """Proves that the checks of folders, lists and includes can fail."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.source = pathlib.Path(folder.name)
        for library in LIBRARIES:
            self.write(f"{library}/README.md", f"## Rooms\n- `{library}/a`: A.\n## More\n- `core/b`\n")
            self.write(f"{library}/a/a.h", '#pragma once\n#include "core/a/a.h"\n')

    def write(self, path, text):
        (self.source / path).parent.mkdir(parents=True, exist_ok=True)
        (self.source / path).write_text(text, encoding="utf-8")

    def test_lists(self):
        self.assertEqual(rooms(self.source), ["core/a", "formats/a", "cmd/a"])
        self.assertEqual(lists_and_folders(self.source), [])
        self.write("core/README.md", "## Rooms\n- `core/c`, `core/d`: not `core/a`.\n")
        self.assertEqual(
            lists_and_folders(self.source),
            [
                "core/a: not in the list of core/README.md",
                "core/c: in the list, but there is no such room",
                "core/d: in the list, but there is no such room",
            ],
        )

    def test_includes(self):
        self.assertIn(("cmd/a/a.h", 2, "core/a/a.h"), includes(self.source))
        self.assertEqual(not_from_the_root(self.source), [])
        self.write("cmd/a/b.cpp", '\n#include "a.h"\n#include "../a/a.h"\n')
        self.assertEqual(
            not_from_the_root(self.source),
            [
                'cmd/a/b.cpp:2: "a.h" is no path from the root',
                'cmd/a/b.cpp:3: "../a/a.h" is no path from the root',
            ],
        )

    def test_includes_of_public_headers(self):
        self.write("cmd/a/c.cpp", "#include <peeler/a.h>\n#include <vector>\n")
        self.assertIn(("cmd/a/c.cpp", 1, "cmd/library/include/peeler/a.h"), includes(self.source))
        self.assertEqual(not_from_the_root(self.source), [])

    def test_exports(self):
        self.write(PUBLIC + "peeler/a.h", "#pragma once\n" + EXPORTS)
        self.assertEqual(exports(self.source), [])
        self.write(PUBLIC + "peeler/b.h", "#pragma once\n")
        self.write("core/a/b.h", EXPORTS)
        self.assertEqual(
            exports(self.source),
            [
                "cmd/library/include/peeler/b.h: is public, but shares nothing",
                "core/a/b.h: is not public, but shares names",
            ],
        )

    def test_rooms_of_verbs(self):
        self.assertEqual(verb_rooms(self.source), [])
        self.write("cmd/a.cpp", "")
        self.assertEqual(verb_rooms(self.source), ["cmd/a"])


if __name__ == "__main__":
    unittest.main()
