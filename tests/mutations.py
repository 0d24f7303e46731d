# SPDX-License-Identifier: Apache-2.0
"""Runs mutation tests: changes the product in one place at a time, which the tests must detect.

    sh tests/run.sh mutations [--count N] [--seed S] [--list] [FILE ...]

Places are chosen by a rule on the parsed source, so edits elsewhere do not change the choice. For C++, clang's AST
gives the comparisons, sums and products, conditions, constants and calls. For shaders, which clang does not parse, the
tokens give the operators. The choice takes turns among rooms, files and rules. FILE restricts it to those files.

Works on a copy of the tree in build/mutations. Runs the labels of ctest from the fastest to the slowest, each up to its
first failure. Prints each mutation and the test that detected it, and the text of each mutation that no test detected.
Inspect the undetected ones: some have no observable effect. Exits with 1 if a mutation was not detected.
"""

import argparse
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import time

import single_files

SOURCE = pathlib.Path(__file__).resolve().parents[1]
COPY = SOURCE / "build" / "mutations"
FOLDERS = ("core", "formats", "cmd")
SHADERS = (".glsl", ".vert", ".frag", ".comp")
LABELS = ("unit", "fuzz", "cli", "gl", "process", "python", "assets", "examples")

COMPARED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
CALCULATED = {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+="}
COMBINED = {"&&": "||", "||": "&&"}
OPERATORS = {"comparison": COMPARED, "calculation": CALCULATED, "combination": COMBINED}
RULES = (*OPERATORS, "condition", "constant", "statement")


class Mutation:
    """A replacement for the bytes [begin, end) of a file."""

    def __init__(self, rule, file, text, begin, end, mutated, where):
        self.rule, self.file, self.begin, self.end, self.mutated = rule, file, begin, end, mutated
        self.line = text.count(b"\n", 0, begin) + 1
        # The place is identified by its context instead of its line, so that edits above the place do not change the
        # choice.
        self.place = f"{rule} {file} {where} {text[begin:end].decode(errors='replace')} {mutated}"

    def __str__(self):
        return f"{self.file}:{self.line} {self.rule}"

    def rank(self, seed):
        return hashlib.sha256(f"{seed} {self.place}".encode()).digest()


def statement_end(text, end):
    """Returns the end of the statement that ends at `end` without its semicolon; None if no semicolon follows."""
    found = re.compile(rb"\s*;").match(text, end)
    return found.end() if found else None


def of_shader(path, name):
    """Yields the mutations of a shader's operators, found among its tokens."""
    text = path.read_bytes()
    code = re.sub(rb"//[^\n]*|^#[^\n]*", lambda found: b" " * len(found[0]), text, flags=re.MULTILINE)
    counted = {}
    for token in re.finditer(rb"(?<=\s)(<=|>=|==|!=|&&|\|\||\+=|-=|[<>*/+-])(?=\s)", code):
        for rule, operators in OPERATORS.items():
            mutated = operators.get(token[0].decode())
            if mutated:
                number = counted[token[0]] = counted.get(token[0], 0) + 1
                yield Mutation(rule, name, text, token.start(), token.end(), mutated, number)


def of_source(path, name, folder, flags, clang):
    """Yields the mutations of a .cpp, found in clang's AST."""
    text = path.read_bytes()
    unit = clang.Index.create().parse(
        str(path), args=[*(flag for flag in flags[1:] if not flag.startswith("-W")), "-w"],
        options=clang.TranslationUnit.PARSE_INCOMPLETE)
    kinds, counted = clang.CursorKind, {}

    def mutation(rule, begin, end, mutated, function):
        where = (rule, function)
        counted[where] = counted.get(where, 0) + 1
        return Mutation(rule, name, text, begin, end, mutated, f"{function} {counted[where]}")

    def walk(cursor, function, parent):
        if cursor.kind in (kinds.FUNCTION_DECL, kinds.CXX_METHOD, kinds.CONSTRUCTOR, kinds.FUNCTION_TEMPLATE):
            function = cursor.spelling
        begin, end = cursor.extent.start.offset, cursor.extent.end.offset
        children = list(cursor.get_children())
        if function and begin < end:
            if cursor.kind in (kinds.BINARY_OPERATOR, kinds.COMPOUND_ASSIGNMENT_OPERATOR) and len(children) == 2:
                between = text[children[0].extent.end.offset:children[1].extent.start.offset]
                spelled = between.strip().decode(errors="replace")
                at = children[0].extent.end.offset + between.find(spelled.encode())
                for rule, operators in OPERATORS.items():
                    if spelled in operators:
                        yield mutation(rule, at, at + len(spelled), operators[spelled], function)
            elif cursor.kind == kinds.IF_STMT and children and children[0].kind != kinds.DECL_STMT:
                first, last = children[0].extent.start.offset, children[0].extent.end.offset
                negated = "!(" + text[first:last].decode(errors="replace") + ")"
                if text[first - 1:first] == b"(" and text[last:last + 1] == b")":
                    yield mutation("condition", first, last, negated, function)
            elif cursor.kind == kinds.INTEGER_LITERAL and re.fullmatch(rb"\d+", text[begin:end]):
                yield mutation("constant", begin, end, str(int(text[begin:end]) + 1), function)
            elif cursor.kind == kinds.CALL_EXPR and parent == kinds.COMPOUND_STMT:
                until = statement_end(text, end)
                if until:
                    yield mutation("statement", begin, until, ";", function)
        for child in children:
            if child.location.file is None or child.location.file.name == str(path):
                yield from walk(child, function, cursor.kind)

    os.chdir(folder)
    yield from walk(unit.cursor, "", None)


def files_of(build, only):
    """Returns {name: (folder, compiler and flags), or None for a shader} for the product's files, or for the named
    files."""
    units, _ = single_files.commands(build)
    found = {}
    for folder in FOLDERS:
        for path in sorted((COPY / folder).rglob("*.cpp")):
            if path in units:
                found[str(path.relative_to(COPY))] = units[path]
    for path in sorted((COPY / "shaders").iterdir()):
        if path.suffix in SHADERS:
            found[str(path.relative_to(COPY))] = None
    return {name: how for name, how in found.items() if not only or name in only}


def mutations_of(name, how):
    from clang import cindex as clang  # pylint: disable=import-outside-toplevel  # of python3-clang

    return list(of_shader(COPY / name, name) if how is None else of_source(COPY / name, name, *how, clang))


def chosen_of(files, count, seed):
    """Returns `count` mutations, taking turns among the rooms, the files of a room, and the rules."""

    def rank(name):
        return hashlib.sha256(f"{seed} {name}".encode()).digest()

    rooms = {}
    for name in sorted(files, key=rank):
        rooms.setdefault(name.rpartition("/")[0], []).append(name)
    order = [names[turn] for turn in range(max(map(len, rooms.values()), default=0))
             for _, names in sorted(rooms.items()) if turn < len(names)]
    places, chosen = {}, []
    while order and len(chosen) < count:
        name = order.pop(0)
        if name not in places:
            places[name] = sorted(mutations_of(name, files[name]), key=lambda m: m.rank(seed))
        wanted = RULES[len(chosen) % len(RULES):] + RULES[:len(chosen) % len(RULES)]
        for rule in wanted:
            found = next((place for place in places[name] if place.rule == rule), None)
            if found:
                places[name].remove(found)
                chosen.append(found)
                order.append(name)  # moves it to the end of the queue
                break
    return chosen


def run(*command, **options):
    return subprocess.run(
        command, cwd=COPY, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        **options,
    )


def copy_tree():
    """Copies the tracked files. Unchanged files keep their times, so that only changed ones are compiled again."""
    COPY.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, check=True, capture_output=True)
    for name in listed.stdout.decode().split("\0"):
        source, target = SOURCE / name, COPY / name
        if not source.is_file():
            continue
        content = source.read_bytes()
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            target.chmod(source.stat().st_mode)


def build():
    done = run("cmake", "--build", "--preset", "ci", "-j", str(os.cpu_count()))
    return "" if done.returncode == 0 else done.stdout[-3000:]


def seen_by():
    """Returns the name of the first test that fails; nothing if none fails."""
    for label in LABELS:
        done = run("ctest", "--preset", "ci", "-L", label, "-j", str(os.cpu_count()), "--stop-on-failure",
                   env={**os.environ, "GTEST_FAIL_FAST": "1", "GTEST_BRIEF": "1"})
        if done.returncode != 0:
            failed = [line for line in done.stdout.splitlines() if "[  FAILED  ]" in line]
            return failed[0].partition("]")[2].strip() if failed else done.stdout[-300:].strip()
    return ""


def try_mutation(mutation):
    """Returns (whether a test sees the mutation, the message). Restores the tree before it returns."""
    path = COPY / mutation.file
    whole = path.read_bytes()
    path.write_bytes(whole[:mutation.begin] + mutation.mutated.encode() + whole[mutation.end:])
    problem = build()
    red = "" if problem else seen_by()
    line = path.read_text(encoding="utf-8").splitlines()[mutation.line - 1].strip()
    path.write_bytes(whole)
    if problem:
        return True, "seen by the compiler"
    return bool(red), f"seen by {red}" if red else f"NOT SEEN: {line}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=48, help="how many mutations (default: 48)")
    parser.add_argument("--seed", default="0", help="another choice (default: 0)")
    parser.add_argument("--list", action="store_true", help="only print what would be tried")
    parser.add_argument("files", nargs="*", help="of these files only")
    options = parser.parse_args()

    copy_tree()
    os.environ.setdefault("PEELER_ASSETS", str(SOURCE.parent / "shared" / "assets"))
    configured = run("cmake", "--preset", "ci", "-DPEELER_WERROR=OFF", "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG",
                     *os.environ.get("PEELER_CMAKE_ARGUMENTS", "").split())
    problem = configured.stdout[-3000:] if configured.returncode != 0 else ""
    if not problem and not options.list:
        problem = build()
    if problem:
        print(problem)
        return 1
    chosen = chosen_of(files_of(COPY / "build" / "ci", options.files), options.count, options.seed)

    unseen = 0
    for mutation in chosen:
        start = time.monotonic()
        seen, verdict = (True, mutation.mutated) if options.list else try_mutation(mutation)
        unseen += not seen
        print(f"{mutation}: {verdict} ({time.monotonic() - start:.0f} s)", flush=True)
    if not options.list:
        print(f"{len(chosen) - unseen} of {len(chosen)} mutations were seen")
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
