#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the time per frame in one process for all frames with that in one process per frame.

    python3 tests/benchmarks/frames_in_one_process.py build/release/peeler SCENE... \
        [--frames 20] [--runs 3] [-- options of peeler render]

Both ways render the same frames into the same folder, in turn; the fastest run of each counts. Compares the files.
Prints a row of Markdown per scene.
"""
import argparse
import hashlib
import pathlib
import subprocess
import sys
import tempfile
import time


def digest(folder):
    sums = {}
    for file in sorted(folder.iterdir()):
        sums[file.name] = hashlib.sha256(file.read_bytes()).hexdigest()
    return sums


def seconds(commands):
    start = time.monotonic()
    for command in commands:
        subprocess.run(command, check=True)
    return time.monotonic() - start


def main():
    own, more = sys.argv[1:], []
    if "--" in own:
        at = own.index("--")
        own, more = own[:at], own[at + 1:]
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args(own)

    print("| scene | frames | one process, ms a frame | a process each, ms a frame | ratio |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            command = [options.peeler, "render", scene, "-o", str(folder / "f.####.exr"), "-q", *more]
            whole = [command + ["--frames", f"1-{options.frames}"]]
            each = [command + ["--frames", str(i)] for i in range(1, options.frames + 1)]
            best = [float("inf")] * 2
            sums = []
            for _ in range(options.runs):
                for way, commands in enumerate((whole, each)):
                    best[way] = min(best[way], seconds(commands))
                    sums.append(digest(folder))
            if any(s != sums[0] for s in sums):
                sys.exit(f"{scene}: the files differ")
            one, many = (1000 * t / options.frames for t in best)
            name = " ".join([pathlib.Path(scene).stem, *more])
            print(f"| {name} | {options.frames} | {one:.0f} | {many:.0f} | {one / many:.2f} |")


if __name__ == "__main__":
    main()
