#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes scenes in every form, layout and compression, and prints sizes and times as a Markdown table.

    python3 tests/benchmarks/file_sizes.py PEELER SCENE... [--size 1920x1080] [--runs 3] [-- OPTIONS OF RENDER]

The columns of a scene are the file's size, and the milliseconds of encoding and writing in the fastest run.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

FORMS = (  # labels of rows, and options of render
    ("layers, zip (default)", ()),
    ("layers, zips", ("--compression", "zips")),
    ("layers, rle", ("--compression", "rle")),
    ("layers, none", ("--compression", "none")),
    ("`--layout nuke`", ("--layout", "nuke")),
    ("`--layout single-part`", ("--layout", "single-part")),
    ("`--layout per-file`", ("--layout", "per-file")),
    ("`--precision float`", ("--precision", "float")),
    ("`--channels id`", ("--channels", "id")),
    ("`--channels normal,position`", ("--channels", "normal,position")),
    ("deep, zips (default)", ("--as", "deep")),
    ("deep, rle", ("--as", "deep", "--compression", "rle")),
    ("deep, none", ("--as", "deep", "--compression", "none")),
    ("deep, `--channels id`", ("--as", "deep", "--channels", "id")),
    ("deep, `--deep-merge exact`", ("--as", "deep", "--deep-merge", "exact")),
)


def quickest(peeler: str, scene: str, size: str, runs: int, more: list) -> tuple:
    """Returns the file's size and, from the fastest run, the milliseconds of encoding and writing."""
    results = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(runs):
            command = [peeler, "render", scene, "-o", f"{folder}/out.exr", "--size", size, "--json", "--quiet", *more]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            result = json.loads(done.stdout)
            results.append((result["bytes"], result["milliseconds"]["encode"] + result["milliseconds"]["write"]))
    return min(results, key=lambda result: result[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--runs", type=int, default=3)
    own, _, more = " ".join(sys.argv[1:]).partition(" -- ")
    options = parser.parse_args(own.split())

    names = [pathlib.Path(scene).stem for scene in options.scenes]
    print("| | " + " | ".join(f"{name}, MB | {name}, ms" for name in names) + " |")
    print("| --- |" + " ---: |" * 2 * len(names))
    for name, form in FORMS:
        cells = [quickest(options.peeler, scene, options.size, options.runs, [*form, *more.split()])
                 for scene in options.scenes]
        print(f"| {name} | " + " | ".join(f"{size / 1e6:.1f} | {time:.0f}" for size, time in cells) + " |",
              flush=True)


if __name__ == "__main__":
    main()
