# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on the product's files of a build folder, many as one unit.

    style_units.py BUILD_FOLDER OUT_FOLDER [all]

Takes the files that differ from the last landed commit (or whose first include differs), and a random quarter of the
others, a different quarter at every commit, but at most half of all files. With `all`, takes all files.

clang-tidy spends most of a unit's time on library headers, so files with the same flags become one unit: a file of
includes in OUT_FOLDER, next to a compile_commands.json for the units. A unit whose files do not compile together, for
example because two define a function of the same name, is split as in the build. Skips tests, and files of the product
that tests compile again.
"""

import concurrent.futures
import itertools
import json
import os
import pathlib
import subprocess
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


def write_unit(unit, files):
    unit.write_text("".join(f'#include "{file}"\n' for file in sorted(files)))


def tidy(unit, out):
    """Returns what clang-tidy prints about a unit, and whether it found nothing."""
    # clang does not know all of GCC's warnings. GCC checks for shadowed names in each file; a unit here has many
    # unrelated files.
    ignored = [f"--extra-arg=-Wno-{warning}" for warning in ("unknown-warning-option", "shadow")]
    done = subprocess.run(
        ["clang-tidy", "-p", out, "--quiet", *ignored, unit], capture_output=True, text=True, check=False
    )
    return done.stdout, done.returncode == 0


def tidy_or_split(unit, parts, out):
    """Tidies a unit; if its files do not compile together, tidies those of each unit of the build, which do."""
    text, clean = tidy(unit, out)
    if clean or "clang-diagnostic-error" not in text or len(parts) == 1:
        return text, clean
    texts = []
    for number, files in enumerate(parts):
        part = unit.with_name(f"{unit.stem}_{number}.cpp")
        write_unit(part, files)
        texts.append(tidy(part, out))
    return "".join(text for text, _ in texts), all(clean for _, clean in texts)


def main(build, out, every):
    out.mkdir(parents=True, exist_ok=True)
    for unit in out.glob("unit_*.cpp"):
        unit.unlink()
    groups = {}  # {(flags, folder): files of each unit of the build}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        flags, _, output = entry["command"].partition(" -o ")
        if not output.startswith("tests/"):
            unit = pathlib.Path(entry["file"])
            groups.setdefault((flags, unit.parent), []).append(single_files.files_of(unit))
    if not every:
        chosen = chosen_of({file for parts in groups.values() for part in parts for file in part}, single_files.SOURCE)
        groups = {key: [[file for file in part if file in chosen] for part in parts] for key, parts in groups.items()}
    units = [(flags, [part for part in parts if part]) for (flags, _), parts in groups.items() if any(parts)]
    units.sort(key=lambda unit: -sum(file.stat().st_size for part in unit[1] for file in part))
    commands, jobs = [], []
    for number, (flags, parts) in enumerate(units):
        unit = out / f"unit_{number}.cpp"
        write_unit(unit, itertools.chain(*parts))
        jobs.append((unit, parts))
        for path in (unit, *(unit.with_name(f"{unit.stem}_{part}.cpp") for part in range(len(parts)))):
            commands.append({"directory": str(build), "command": f"{flags} -c {path}", "file": str(path)})
    (out / "compile_commands.json").write_text(json.dumps(commands, indent=1))

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda job: tidy_or_split(*job, out), jobs))
    print("".join(text for text, _ in results), end="")
    if not all(clean for _, clean in results):
        return 1
    print(f"clang-tidy: no findings in {sum(len(part) for _, parts in jobs for part in parts)} files")
    return 0


sys.exit(main(*(pathlib.Path(name).resolve() for name in sys.argv[1:3]), sys.argv[3:] == ["all"]))
