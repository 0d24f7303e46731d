# SPDX-License-Identifier: Apache-2.0
"""What clang-tidy reads: the product's units of a build folder, many as one.

    style_units.py BUILD_FOLDER OUT_FOLDER

Most of what clang-tidy takes for a unit goes to the headers of libraries, and grows little with the
files of ours behind them. Units of one folder that are compiled alike become one here: a file of
includes in OUT_FOLDER, beside a compile_commands.json for these. Prints their paths, the units with
the most to read first. Tests, and what they compile once more, are left out."""

import json
import pathlib
import re
import sys


def size(unit):
    """Of what it is made of, in bytes."""
    if unit.suffix != ".cxx":
        return unit.stat().st_size
    return sum(pathlib.Path(name).stat().st_size for name in re.findall(r'#include "(.*)"', unit.read_text()))


def main():
    build, out = (pathlib.Path(name).resolve() for name in sys.argv[1:])
    out.mkdir(parents=True, exist_ok=True)
    groups = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        flags, _, output = entry["command"].partition(" -o ")
        if output.startswith("tests/"):
            continue
        unit = pathlib.Path(entry["file"])
        groups.setdefault((flags, unit.parent), []).append(unit)
    commands = []
    for number, ((flags, _), units) in enumerate(sorted(groups.items(), key=lambda group: -sum(map(size, group[1])))):
        file = out / f"unit_{number}.cpp"
        file.write_text("".join(f'#include "{unit}"\n' for unit in sorted(units)))
        commands.append({"directory": str(build), "command": f"{flags} -c {file}", "file": str(file)})
        print(file)
    (out / "compile_commands.json").write_text(json.dumps(commands, indent=1))


main()
