# SPDX-License-Identifier: Apache-2.0
"""Prepares the input of clang-tidy: the product's files of a build folder, many as one unit.

    style_units.py BUILD_FOLDER OUT_FOLDER [all]

Takes the files that differ from the last landed commit (or whose first include differs), and a random quarter of the
others, a different quarter at every commit, but at most half of all files. With `all`, takes all files.

clang-tidy spends most of a unit's time on library headers, so files with the same flags become one unit: a file of
includes in OUT_FOLDER, next to a compile_commands.json for the units. Prints the paths of the units, the largest unit
first. Skips tests, and files of the product that tests compile again.
"""

import json
import pathlib
import sys

import single_files

SHARE = 4
MOST = 0.5  # of all files


def chosen_of(files, source):
    changed = single_files.different(source)[1]
    first = {file for file in files if file in changed or changed & set(single_files.includes(source, file)[:1])}
    rest, turn = sorted(set(files) - first), single_files.turn_of(source)
    chosen = first | set(turn.sample(rest, len(rest) // SHARE))
    return set(turn.sample(sorted(chosen), min(len(chosen), int(MOST * len(files)))))


def main(build, out, every):
    out.mkdir(parents=True, exist_ok=True)
    for unit in out.glob("unit_*.cpp"):
        unit.unlink()
    groups = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        flags, _, output = entry["command"].partition(" -o ")
        if output.startswith("tests/"):
            continue
        unit = pathlib.Path(entry["file"])
        groups.setdefault((flags, unit.parent), []).extend(single_files.files_of(unit))
    if not every:
        chosen = chosen_of({file for files in groups.values() for file in files}, single_files.SOURCE)
        groups = {key: [file for file in files if file in chosen] for key, files in groups.items()}
    groups = {key: files for key, files in groups.items() if files}
    commands = []
    sizes = {key: sum(file.stat().st_size for file in files) for key, files in groups.items()}
    for number, key in enumerate(sorted(groups, key=lambda key: -sizes[key])):
        unit = out / f"unit_{number}.cpp"
        unit.write_text("".join(f'#include "{file}"\n' for file in sorted(groups[key])))
        commands.append({"directory": str(build), "command": f"{key[0]} -c {unit}", "file": str(unit)})
        print(unit)
    (out / "compile_commands.json").write_text(json.dumps(commands, indent=1))


main(*(pathlib.Path(name).resolve() for name in sys.argv[1:3]), sys.argv[3:] == ["all"])
