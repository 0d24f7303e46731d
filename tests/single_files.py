# SPDX-License-Identifier: Apache-2.0
"""Tests that every .cpp and every header compiles alone, although the build is a unity build.

    single_files.py BUILD_FOLDER [headers]

Compiles, without output, the files that differ from the last landed commit and the files that include them (at most 24,
chosen at random, the product's before the tests), and as many others as SECONDS allow, in a different order at every
commit. The last landed commit is this branch's merge base with origin/main. If the merge base is unknown or is the
current commit, the thirtieth commit before the current one is used instead. Skips files that the build itself compiles
alone, and headers that a .cpp includes first. With `headers`, compiles only headers that no .cpp includes first.
"""

import concurrent.futures
import json
import os
import pathlib
import random
import re
import shlex
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).resolve().parents[1]
FOLDERS = ("core", "formats", "cmd", "tests")
INCLUDE = re.compile(r'^ *# *include ["<]([^">]+)[">]', re.MULTILINE)
SECONDS = 8
MOST_DIFFERENT = 24
COMMITS = 30


def git(source, *arguments):
    """Returns the lines that git prints; none if it fails, for example outside a repository."""
    done = subprocess.run(["git", *arguments], cwd=source, capture_output=True, text=True, check=False)
    return done.stdout.splitlines() if done.returncode == 0 else []


def files_of(unit):
    """Returns the source files in a unit of the build."""
    files = [unit] if unit.suffix == ".cpp" else map(pathlib.Path, INCLUDE.findall(unit.read_text()))
    return [file.resolve() for file in files]


def turn_of(source):
    """Returns a random number generator with a different seed for every commit."""
    return random.Random("".join(git(source, "rev-parse", "HEAD")))


def commands(build):
    """Returns {.cpp: (folder, compiler and flags)}, and the set of the files that the build compiles alone."""
    found, alone = {}, set()
    for entry in json.loads((build / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"].partition(" -o ")[0])
        if "ccache" in words[0]:
            del words[0]
        unit = pathlib.Path(entry["file"])
        for file in files_of(unit):
            found.setdefault(file, (entry["directory"], words))
            alone |= {file} if unit.suffix == ".cpp" else set()
    return found, alone


def includes(source, file):
    """Returns the files of our own that a file includes, in order."""
    roots = [source / "tests"] if source / "tests" in file.parents else []
    roots += [source, source / "cmd/library/include"]
    found = []
    for name in INCLUDE.findall(file.read_text(encoding="utf-8")):
        found += [root / name for root in roots if (root / name).is_file()][:1]
    return found


def different(source):
    """Returns (the last landed commit, the files that differ from it)."""
    base = git(source, "merge-base", "HEAD", "origin/main")
    if not base or base == git(source, "rev-parse", "HEAD"):
        base = git(source, "rev-parse", f"HEAD~{COMMITS}")
    if not base:
        return "nowhere", set()
    names = git(source, "diff", "--name-only", base[0]) + git(source, "ls-files", "-o", "--exclude-standard")
    return base[0][:10], {source / name for name in names}


def compile_alone(unit):
    """Returns the compiler's message; None if there was no error."""
    file, (folder, flags) = unit
    text = "" if file.suffix == ".cpp" else f'#include "{file}"\n'
    done = subprocess.run(
        [*flags, "-O0", "-w", "-fsyntax-only", *(["-x", "c++", "-"] if text else [str(file)])],
        cwd=folder,
        input=text,
        capture_output=True,
        text=True,
        check=False,
    )
    return None if done.returncode == 0 else f"{file}: does not compile by itself\n{done.stderr[:2000]}"


def files_to_compile(build, source):
    """Returns ({file: (folder, compiler and flags)} for files that the build does not compile alone, {file: the files
    of our own that it includes})."""
    units, alone = commands(build)
    included = {file: includes(source, file) for folder in FOLDERS for file in (source / folder).rglob("*.h")}
    included |= {file: includes(source, file) for file in units if source in file.parents}
    firsts = {files[0] for file, files in included.items() if file in units and files}
    for header in sorted(file for file in included if file.suffix == ".h" and file not in firsts):
        # A header gets the flags of a file that includes it, or of a file in a nearby folder.
        near = [file for file in units if header in included.get(file, ())]
        near += [file for file in units if file.parent in header.parents or header.parent in file.parents]
        if near:
            units[header] = units[near[0]]
    return {file: how for file, how in units.items() if file not in alone and file in included}, included


def chosen_of(units, included, source):
    """Returns (the files that are always compiled, the others in order, a text that explains the choice of the
    former)."""
    base, changed = different(source)
    turn = turn_of(source)
    first = sorted(file for file in units if file in changed or changed & set(included[file][:1]))
    others = sorted(file for file in units if file not in first and changed & set(included[file]))
    turn.shuffle(first)
    turn.shuffle(others)
    first = sorted(first + others, key=lambda file: source / "tests" in file.parents)[:MOST_DIFFERENT]
    rest = sorted(set(units) - set(first))
    turn.shuffle(rest)
    return first, rest, f"{len(first)} that differ from {base} or include what does, and of the others what {SECONDS} s allow"


def main(build, headers_only, source=SOURCE):
    started = time.monotonic()
    units, included = files_to_compile(build, source)
    first, rest, how = [file for file in units if file.suffix == ".h"], [], "all headers that no .cpp includes first"
    if not headers_only:
        first, rest, how = chosen_of(units, included, source)

    def error_of(file):
        """Returns whether the file was compiled, and the compiler's message."""
        if file in others and time.monotonic() - started > SECONDS:
            return False, None
        return True, compile_alone((file, units[file]))

    others = set(rest)
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        results = list(pool.map(error_of, first + rest))
    errors = [error for _, error in results if error]
    compiled = sum(done for done, _ in results)
    print(*errors, sep="\n", end="")
    print(f"single files: {compiled} of {len(units)}: {how}; {len(errors)} fail; {time.monotonic() - started:.0f} s")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve(), "headers" in sys.argv[2:]))
