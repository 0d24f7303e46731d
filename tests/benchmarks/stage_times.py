#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders scenes with every method, side by side, and prints where the time goes as Markdown tables.

    python3 tests/benchmarks/stage_times.py PEELER SCENE... [--size 1920x1080] [--runs 3] [--methods a-buffer,dual]
                                            [-- OPTIONS OF RENDER]

If there are several scenes, the first table has all stages of the first method. The last table has the capture and the
total of every method. Of the runs of a command, the one with the smallest total counts. Milliseconds.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

METHODS = ("a-buffer", "front-to-back", "two-pass", "back-to-front", "dual")
STAGES = ("load", "context", "upload", "count", "capture", "sort", "composite", "encode", "write", "total")


def best(peeler: str, scene: str, method: str, size: str, runs: int, more: list) -> dict:
    """Returns the JSON result of the fastest of `runs` runs."""
    results = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(runs):
            command = [peeler, "render", scene, "-o", f"{folder}/out.exr", "--method", method,
                       "--size", size, "--json", "--quiet", *more]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            results.append(json.loads(done.stdout))
    return min(results, key=lambda result: result["milliseconds"]["total"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--methods", default=",".join(METHODS))
    own, _, more = " ".join(sys.argv[1:]).partition(" -- ")
    options = parser.parse_args(own.split())

    methods, names = options.methods.split(","), [pathlib.Path(scene).stem for scene in options.scenes]
    results = [[best(options.peeler, scene, method, options.size, options.runs, more.split()) for scene in options.scenes]
               for method in methods]
    if len(names) > 1:
        columns = (" ".join([methods[0], *more.split()]) + ", ms", "layers", "fragments, M", *STAGES, "file, MB", "peak, MB")
        print("| " + " | ".join(columns) + " |")
        print("| --- |" + " ---: |" * (len(columns) - 1))
        for name, result in zip(names, results[0]):
            cells = [name, str(result["layers"]), f'{result["fragmentsCounted"] / 1e6:.2f}',
                     *(f'{result["milliseconds"][stage]:.0f}' for stage in STAGES),
                     f'{result["bytes"] / 1e6:.1f}', f'{result["peakMemory"] / 1e6:.0f}']
            print("| " + " | ".join(cells) + " |")
        print()
    print("| capture / total, ms | " + " | ".join(names) + " |")
    print("| --- |" + " ---: |" * len(names))
    for method, row in zip(methods, results):
        times = [result["milliseconds"] for result in row]
        print(f"| {method} | " + " | ".join(f'{ms["capture"]:.0f} / {ms["total"]:.0f}' for ms in times) + " |")


if __name__ == "__main__":
    main()
