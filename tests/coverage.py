# SPDX-License-Identifier: Apache-2.0
"""Prints the share of lines and branches of cmd/, core/ and formats/ that the tests cover, as a table by folder.

    python3 tests/coverage.py BUILD_FOLDER [FILES]

FILES is the number of least covered files to list (default 10). The build folder must be of preset `coverage`, after a
run of the tests; gcovr reads gcc's counters there. Does not count branches that only exceptions take.
"""

import collections
import json
import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[1]
FOLDERS = ("cmd", "core", "formats")


def files(build):
    """Returns gcovr's record for every file of the product."""
    command = ["gcovr", "--root", SOURCE, "--object-directory", build, "--json-summary", "-"]
    command += ["--exclude-throw-branches", "--exclude-unreachable-branches"]
    for folder in FOLDERS:
        command += ["--filter", f"{SOURCE}/{folder}/"]
    done = subprocess.run([*command, build], stdout=subprocess.PIPE, check=True, cwd=SOURCE)
    return json.loads(done.stdout)["files"]


def main():
    found = files(pathlib.Path(sys.argv[1]).resolve())
    sums = collections.defaultdict(collections.Counter)
    for file in found:
        for key in ("line_covered", "line_total", "branch_covered", "branch_total"):
            sums[file["filename"].split("/")[0]][key] += file[key]

    print("| folder | lines | covered | branches | covered |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for folder in FOLDERS:
        row = sums[folder]
        cells = [
            f"{row[f'{kind}_total']:,} | {100 * row[f'{kind}_covered'] / row[f'{kind}_total']:.2f} %"
            for kind in ("line", "branch")
        ]
        print(f"| {folder} | {' | '.join(cells)} |")

    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    missed = sorted(found, key=lambda file: file["line_covered"] - file["line_total"])[:count]
    print("\nlines not reached, by file:")
    for file in missed:
        print(f"{file['line_total'] - file['line_covered']:6d} of {file['line_total']:5d}  {file['filename']}")


if __name__ == "__main__":
    main()
