# SPDX-License-Identifier: Apache-2.0
"""clang-tidy's input: the product's files of a build folder, many as one unit.

    style_units.py BUILD_FOLDER OUT_FOLDER [all]

The files that differ from the last landed commit (or have a different header), and a quarter of the others, a
different one at every commit; `all`: all of them. clang-tidy spends most of a unit's time on library headers, and
little more for each of our files after them. Files with the same flags become one unit: a file of includes in
OUT_FOLDER, beside a compile_commands.json for these. Prints their paths, the largest units first. Skips tests, and
files that they compile again."""

import json
import pathlib
import sys

import single_files

SHARE = 4


def chosen_of(files, source):
    changed = single_files.different(source)[1]
    first = {file for file in files if file in changed or changed & set(single_files.includes(source, file)[:1])}
    rest = sorted(set(files) - first)
    return first | set(single_files.turn_of(source).sample(rest, len(rest) // SHARE))


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
